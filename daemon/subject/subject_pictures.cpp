#include "daemon/subject/subject_pictures.h"

#include <fmt/format.h>

#include <array>

#include "core/parallel.h"
#include "reconstruction/volume/slice_picture.h"

namespace skullstation {

namespace {

constexpr int surface_picture_px = 400;
constexpr int rays_per_pixel = 3;

struct PlannedSlice {
  const char* name;
  int axis;
  double share;  ///< of the head's extent along the axis
};

constexpr std::array<PlannedSlice, 12> planned_slices = {{{"axial", 2, 0.08},
                                                          {"axial", 2, 0.22},
                                                          {"axial", 2, 0.36},
                                                          {"axial", 2, 0.50},
                                                          {"axial", 2, 0.66},
                                                          {"axial", 2, 0.84},
                                                          {"coronal", 1, 0.15},
                                                          {"coronal", 1, 0.40},
                                                          {"coronal", 1, 0.65},
                                                          {"sagittal", 0, 0.35},
                                                          {"sagittal", 0, 0.50},
                                                          {"sagittal", 0, 0.65}}};

}  // namespace

Result<CaptionedPictures> surface_pictures(const TriangleMesh& mesh, const Eigen::Vector3d& color,
                                           int threads) {
  PicturedMesh pictured;
  pictured.mesh = &mesh;
  pictured.color = color;
  CaptionedPictures pictures;
  const auto done = add_sides(pictures, {&pictured, 1}, {"front", "left", "back"}, "",
                              {surface_picture_px, rays_per_pixel, threads});
  if (!done) return forward(done);
  return pictures;
}

CaptionedPictures slice_pictures(const CtSurfaces& surfaces, int threads) {
  const std::array<SliceOutline, 2> outlines = {
      {{&surfaces.skull, {1.0, 0.55, 0.0}}, {&surfaces.skin, {0.1, 0.75, 1.0}}}};
  const VoxelGrid& grid = surfaces.volume.grid;
  Eigen::AlignedBox3d head;  // in voxels
  for (Eigen::Index v = 0; v < surfaces.skin.vertices.rows(); ++v) {
    head.extend(grid.voxel_from_patient(surfaces.skin.vertices.row(v).transpose()));
  }
  CaptionedPictures pictures(planned_slices.size());
  parallel_for(static_cast<int>(pictures.size()), threads, [&](int p) {
    const auto& [name, axis, share] = planned_slices[static_cast<std::size_t>(p)];
    const double place = head.min()[axis] + share * head.sizes()[axis];
    const int index = std::clamp(static_cast<int>(place), 0, grid.size[axis] - 1);
    pictures[static_cast<std::size_t>(p)] = {
        fmt::format("{} {}", name, index + (axis == 2 ? surfaces.first_slice : 0)),
        slice_picture(surfaces.volume, {axis, index}, outlines)};
  });
  return pictures;
}

}  // namespace skullstation
