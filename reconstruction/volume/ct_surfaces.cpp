#include "reconstruction/volume/ct_surfaces.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/parallel.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/volume/coarse_volume.h"
#include "reconstruction/volume/ct_findings.h"
#include "reconstruction/volume/head_region.h"
#include "reconstruction/volume/hounsfield.h"
#include "reconstruction/volume/isosurface.h"
#include "reconstruction/volume/morphology.h"
#include "reconstruction/volume/skull_field.h"
#include "reconstruction/volume/skull_parts.h"
#include "reconstruction/volume/spinal_canal.h"
#include "reconstruction/volume/spine_split.h"

namespace skullstation {

namespace {

constexpr double coarse_voxel_mm = 1.5;
constexpr double farthest_air_hu = 100.0;

/// The steps' shared state.
struct Work {
  Volume volume;
  CoarseVolume coarse;
  HeadVoxels head;
  std::vector<StreakedSlices> streaks;
  std::optional<SpinalCanal> canal;
  std::optional<MandibleExtent> mandible;
  VoxelMask skull;
  CtQuality quality;
};

Result<void> check_hounsfield(const Volume& volume) {
  const auto air = air_peak(volume);
  if (air && std::abs(*air + 1000.0) <= farthest_air_hu) return {};
  return fail(ErrorKind::bad_input, "CT volume",
              air ? fmt::format("its air lies at {} HU, not near -1000", *air)
                  : std::string("no air is seen round a head in it"),
              "check the Hounsfield offset (--hu-offset)");
}

/// Bone in coarse voxels of the head or next to them.
VoxelMask head_bone(const Work& work, int bone_hu, int threads) {
  const CoarseVolume& coarse = work.coarse;
  const VoxelMask near = dilated(work.head.head, 1.01 * coarse.grid.spacing_mm.norm(),
                                 coarse.grid.spacing_mm, threads);
  const VoxelGrid& grid = work.volume.grid;
  VoxelMask bone(grid.size);
  parallel_for(grid.size.z(), threads, [&](int k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      const std::size_t row = grid.index(0, j, k);
      for (int i = 0; i < grid.size.x(); ++i) {
        const std::size_t v = row + static_cast<std::size_t>(i);
        if (work.volume.hu[v] < bone_hu) continue;
        const Eigen::Vector3i c = coarse.from_fine(i, j, k);
        bone.on[v] = near.on[coarse.grid.index(c.x(), c.y(), c.z())];
      }
    }
  });
  return bone;
}

Result<void> find_skull(Work& work, const CtSurfaceOptions& options) {
  VoxelMask bone = head_bone(work, options.bone_hu, options.threads);
  remove_bone_streaks(work.volume, options.metal_hu, work.streaks, options.longest_spike_mm, bone);
  const double voxel_mm3 = work.volume.grid.spacing_mm.prod();
  if (work.canal) {
    work.quality.spine_removed_mm3 =
        static_cast<double>(remove_spine(work.volume, *work.canal, bone)) * voxel_mm3;
  }
  SkullParts parts = find_skull_parts(bone, work.volume.grid.spacing_mm);
  if (parts.parts_kept == 0) {
    return fail(ErrorKind::no_result, "CT volume",
                fmt::format("holds no bone at or above {} HU", options.bone_hu));
  }
  work.skull = std::move(parts.skull);
  work.quality.bone_parts_kept = parts.parts_kept;
  work.quality.bone_parts_removed = parts.parts_removed;
  work.quality.mandible_apart = parts.mandible_apart;
  if (work.canal) {
    work.mandible = find_mandible(work.skull, *work.canal, work.volume.grid.spacing_mm);
  }
  return {};
}

void drop_slices(VoxelMask& mask, int slices) {
  mask.on.erase(mask.on.begin(),
                mask.on.begin() + static_cast<std::ptrdiff_t>(mask.index(0, 0, slices)));
  mask.size.z() -= slices;
}

template <class Field>
void drop_slices(VoxelGrid& grid, Field& hu, int slices) {
  hu.erase(hu.begin(), hu.begin() + static_cast<std::ptrdiff_t>(grid.index(0, 0, slices)));
  grid.origin_mm = grid.patient_from_voxel({0.0, 0.0, static_cast<double>(slices)});
  grid.size.z() -= slices;
}

/// Cuts the volume below the mandible, at a border of coarse voxels. Returns the number of slices
/// cut off.
int crop(Work& work, double below_mandible_mm) {
  if (!work.mandible) return 0;
  // The paper's point lies at the mandible's back; its offset must leave the chin in.
  const double z_mm = std::min(work.mandible->most_posterior_mm.z(), work.mandible->lowest_z_mm) -
                      below_mandible_mm;
  const int slices = static_cast<int>(std::floor(z_mm / work.volume.grid.spacing_mm.z()));
  const int blocks = slices / work.coarse.block.z();
  if (blocks <= 0) return 0;
  const int fine = blocks * work.coarse.block.z();
  drop_slices(work.volume.grid, work.volume.hu, fine);
  drop_slices(work.coarse.grid, work.coarse.hu, blocks);
  drop_slices(work.skull, fine);
  drop_slices(work.head.head, blocks);
  drop_slices(work.head.removed, blocks);
  work.quality.crop_z_mm = work.volume.grid.origin_mm.z();
  std::erase_if(work.streaks, [&](const StreakedSlices& stack) { return stack.last < fine; });
  for (StreakedSlices& stack : work.streaks) {
    stack.first = std::max(0, stack.first - fine);
    stack.last -= fine;
  }
  return fine;
}

/// What patient coordinates a place in the grid's own mm has.
Eigen::Vector3d in_patient(const VoxelGrid& grid, const Eigen::Vector3d& place_mm) {
  return grid.origin_mm + grid.direction * place_mm;
}

Result<Work> prepare(Volume volume, const CtSurfaceOptions& options) {
  Work work;
  work.volume = oriented_to_patient_axes(std::move(volume));
  if (const auto checked = check_hounsfield(work.volume); !checked) return forward(checked);
  work.quality.spacing_mm = work.volume.grid.spacing_mm;
  work.coarse = coarse_volume(work.volume, coarse_voxel_mm, options.threads);
  auto head = find_head(work.coarse, options.skin_hu, options.threads);
  if (!head) return forward(head);
  work.head = std::move(*head);
  work.quality.surroundings_removed_mm3 = work.head.removed_mm3;
  work.quality.contact_front_mm2 = work.head.contact_front_mm2;
  work.quality.contact_back_mm2 = work.head.contact_back_mm2;
  work.streaks = find_streaks(work.volume, options.metal_hu, options.threads);
  work.quality.streaks = work.streaks;
  work.canal = find_spinal_canal(work.coarse, work.head, options.threads);
  return work;
}

/// Both surfaces are thinned at the same time, each on a thread of its own.
void thin(CtSurfaces& surfaces, const CtSurfaceOptions& options) {
  parallel_for(2, options.threads, [&](int which) {
    TriangleMesh& mesh = which == 0 ? surfaces.skull : surfaces.skin;
    mesh = decimated(mesh, options.decimation);
    mesh.normals = vertex_normals(mesh);
    const MeshTopology topology = topology_of(mesh);
    CtQuality& quality = surfaces.quality;
    (which == 0 ? quality.skull_components : quality.skin_components) = topology.components;
    (which == 0 ? quality.skull_closed_manifold : quality.skin_closed_manifold) =
        topology.is_closed_manifold();
    if (which == 0) {
      quality.skull_openings = topology.components - topology.euler_characteristic / 2;
    }
  });
}

}  // namespace

Result<void> CtSurfaceOptions::validate() const {
  const auto bad = [](const char* what) { return fail(ErrorKind::usage, "CT surfaces", what); };
  if (skin_hu < -900 || skin_hu > 0) return bad("skin_hu must be between air (-900) and water (0)");
  if (bone_hu < 100 || bone_hu > 2500) return bad("bone_hu must be between 100 and 2500");
  if (metal_hu <= bone_hu) return bad("metal_hu must be above bone_hu");
  if (!(crop_below_mandible_mm >= 0.0)) return bad("crop_below_mandible_mm must not be negative");
  if (!(longest_spike_mm > 0.0)) return bad("longest_spike_mm must be positive");
  if (!(seal.closing_radius_mm >= 0.0) || !(seal.depth_mm >= 0.0)) {
    return bad("the seal's lengths must not be negative");
  }
  return decimation.validate();
}

Result<CtSurfaces> extract_ct_surfaces(Volume volume, const CtSurfaceOptions& options,
                                       const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  const auto stopped = [&] { return progress.stop.stop_requested(); };
  const auto cancelled = [] { return fail(ErrorKind::cancelled, "CT surfaces", "was cancelled"); };

  progress.report(0.0, "finding the head");
  auto prepared = prepare(std::move(volume), options);
  if (!prepared) return forward(prepared);
  Work& work = *prepared;
  if (stopped()) return cancelled();
  progress.report(0.2, "finding the skull");
  if (const auto found = find_skull(work, options); !found) return forward(found);
  if (work.mandible) {
    work.quality.mandible_most_posterior_mm =
        in_patient(work.volume.grid, work.mandible->most_posterior_mm);
  }
  CtSurfaces surfaces;
  if (options.crop) surfaces.first_slice = crop(work, options.crop_below_mandible_mm);
  if (stopped()) return cancelled();

  progress.report(0.4, "making the skull's surface");
  surfaces.skull = isosurface(
      work.volume.grid, skull_field(work.volume, work.skull, options.bone_hu, options.threads),
      options.bone_hu - 0.5, options.threads);
  if (stopped()) return cancelled();
  progress.report(0.5, "making the skin's surface");
  SkinField skin = skin_field(
      work.volume, work.coarse, work.head.head, work.streaks,
      {options.skin_hu, options.metal_hu, options.longest_spike_mm, options.seal}, options.threads);
  surfaces.skin = largest_component(
      isosurface(work.volume.grid, skin.hu, options.skin_hu - 0.5, options.threads));
  skin.hu = {};
  if (stopped()) return cancelled();

  add_findings(work.volume, skin.solid, work.mandible.has_value(), work.canal.has_value(),
               work.quality);
  surfaces.quality = std::move(work.quality);
  surfaces.volume = std::move(work.volume);
  progress.report(0.7, "thinning the surfaces");
  thin(surfaces, options);
  if (!surfaces.quality.skull_closed_manifold || !surfaces.quality.skin_closed_manifold) {
    surfaces.quality.findings.push_back(
        {CtWarning::open_surface, "a surface is no closed manifold; please report the scan"});
  }
  return surfaces;
}

}  // namespace skullstation
