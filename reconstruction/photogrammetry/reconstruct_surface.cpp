#include "reconstruction/photogrammetry/reconstruct_surface.h"

#include <Eigen/LU>
#include <algorithm>
#include <string>
#include <utility>

#include "reconstruction/mesh/decimation.h"
#include "reconstruction/mesh/hole_filling.h"
#include "reconstruction/photogrammetry/depth_scatter.h"
#include "reconstruction/photogrammetry/surface_colors.h"
#include "reconstruction/photogrammetry/surface_extraction.h"
#include "reconstruction/photogrammetry/visual_hull.h"

namespace skullstation {

namespace {

/// Median over the views of a pixel's size at the point that all of them look at.
double pixel_on_specimen_mm(std::span<const StereoView> views) {
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const StereoView& view : views) middle += view.centre_mm();
  middle /= static_cast<double>(views.size());
  // Where the lines of sight pass each other: nearer than the cameras' own middle for rings seen
  // from above, so it is searched along them.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const StereoView& view : views) {
    const Rigid3 back = view.camera_from_table.inverse();
    const Eigen::Vector3d direction =
        (back.rotation * view.camera.ray(0.5 * view.camera.width, 0.5 * view.camera.height))
            .normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    normal += across;
    right += across * back.translation;
  }
  normal += 1e-9 * Eigen::Matrix3d::Identity();
  right += 1e-9 * middle;
  const Eigen::Vector3d target = normal.inverse() * right;
  std::vector<double> sizes;
  for (const StereoView& view : views) {
    sizes.push_back((view.centre_mm() - target).norm() / view.camera.fx);
  }
  const auto median = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), median, sizes.end());
  return *median;
}

/// The same mesh if no edge length is asked for.
TriangleMesh thinned(TriangleMesh mesh, double edge_mm, double voxel_mm) {
  if (edge_mm <= 0.0) return mesh;
  // A fraction of a voxel, below what the depths are good for.
  mesh = decimated(mesh, {.edge_mm = edge_mm, .max_error_mm = 0.1 * voxel_mm});
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

/// Closes openings and says which vertices are a guess.
FilledOpenings close_openings(TriangleMesh& mesh, double longest_rim_mm) {
  FilledSurface closed = fill_holes(mesh, longest_rim_mm);
  FilledOpenings filled;
  filled.area_cm2 = 0.01 * closed.filled_mm2;
  filled.closed = closed.holes_filled;
  filled.left_open = closed.holes_left;
  for (const int origin : closed.origin) filled.vertices.push_back(origin < 0);
  mesh = std::move(closed.mesh);
  mesh.normals = vertex_normals(mesh);
  return filled;
}

/// A guess is no measurement, even where photographs show it.
void take_out_guesses(const FilledOpenings& filled, Coverage& coverage) {
  for (std::size_t v = 0; v < filled.vertices.size(); ++v) {
    if (!filled.vertices[v]) continue;
    coverage.views[v] = 0;
    coverage.ground_sample_mm[v] = 0.0f;
    coverage.accuracy_mm[v] = 0.0f;
  }
}

}  // namespace

SurfaceOptions SurfaceOptions::of(ReconstructionQuality quality,
                                  std::span<const StereoView> views) {
  SurfaceOptions options;
  const bool draft = quality == ReconstructionQuality::draft;
  options.depth.finest_level = draft ? 1 : 0;
  options.depth.finest_rounds = quality == ReconstructionQuality::standard ? 1 : 2;
  const double pixel_mm = views.empty() ? 0.25 : pixel_on_specimen_mm(views);
  const double voxel_pixels = draft ? 2.5 : 1.6;
  options.fusion.voxel_mm = std::clamp(pixel_mm * voxel_pixels, 0.05, 20.0);
  return options;
}

Result<void> SurfaceOptions::validate() const {
  if (auto valid = depth.validate(); !valid) return valid;
  if (auto valid = fusion.validate(); !valid) return valid;
  if (auto valid = cleaning.validate(); !valid) return valid;
  if (texture) {
    if (auto valid = texture->validate(); !valid) return valid;
  }
  if (!(edge_mm >= 0.0 && edge_mm <= 50.0) || !(textured_edge_voxels >= 0.0)) {
    return fail(ErrorKind::usage, "surface options", "edge_mm is 0 (as extracted) to 50");
  }
  if (!(closed_rim_mm >= 0.0)) {
    return fail(ErrorKind::usage, "surface options", "a rim can't be shorter than 0 mm");
  }
  return {};
}

Result<std::vector<DepthMap>> find_depths(std::span<const StereoView> views,
                                          const SurfaceOptions& options, const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (views.size() < 3) {
    return fail(ErrorKind::bad_input, "views",
                "a surface takes at least 3 photographs, there are " + std::to_string(views.size()),
                "take one about every 15 degrees");
  }
  for (const StereoView& view : views) {
    if (view.pass == views.front().pass) continue;
    return fail(ErrorKind::usage, view.name, "belongs to another pass than the first view",
                "reconstruct each pass by itself, then join them");
  }
  DepthMapOptions depth = options.depth;
  depth.threads = options.threads;
  const auto hull = carve_visual_hull(views, depth.hull_resolution, options.threads);
  if (!hull) return forward(hull);
  options.after_stage("visual hull");
  auto maps = compute_depth_maps(views, *hull, depth, progress);
  if (maps) options.after_stage("depth maps");
  return maps;
}

Result<ReconstructedSurface> surface_of_depths(std::vector<DepthMap> maps,
                                               std::span<const StereoView> views,
                                               const SurfaceOptions& options,
                                               const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  FusionOptions fusion = options.fusion;
  fusion.threads = options.threads;
  FusedSurface surface;
  {
    const auto volume = fuse_depth_maps(maps, views, fusion, progress.part(0.0, 0.6));
    if (!volume) return forward(volume);
    options.after_stage("fusion");
    surface = extract_surface(*volume, fusion.least_weight, options.threads);
  }
  surface = without_small_pieces(surface, options.cleaning);
  if (surface.mesh.triangles.rows() == 0) {
    return fail(ErrorKind::no_result, "surface", "the views agree on no surface",
                "check poses and masks, light and focus");
  }
  options.after_stage("surface");
  ReconstructedSurface result;
  // What lies this little behind the nearest surface may be that surface itself.
  const double gap_mm = fusion.voxel_mm * fusion.truncation_voxels;
  result.mesh = thinned(std::move(surface.mesh), options.edge_mm, fusion.voxel_mm);
  {
    // What is measured decides what each view sees: a guess hides nothing.
    const Sights sights(result.mesh, views, gap_mm, options.threads);
    options.after_stage("sights");
    if (options.closed_rim_mm > 0.0) {
      result.filled = close_openings(result.mesh, options.closed_rim_mm);
      options.after_stage("closed openings");
    }
    std::vector<float> accuracy_mm = depth_scatter(result.mesh, maps, gap_mm, options.threads);
    maps = {};  // gigabytes that nothing needs any more
    options.after_stage("accuracy");
    result.mesh.colors =
        SurfaceColors(result.mesh, sights, options.threads).vertex_colors(options.threads);
    options.after_stage("colours");
    result.coverage =
        measure_coverage(result.mesh, sights, std::move(accuracy_mm), options.threads);
    take_out_guesses(result.filled, result.coverage);
    options.after_stage("coverage");
  }
  if (options.texture) {
    const double edge_mm =
        std::max(options.edge_mm, options.textured_edge_voxels * fusion.voxel_mm);
    const TriangleMesh mesh = thinned(result.mesh, edge_mm, fusion.voxel_mm);
    options.after_stage("thinning");
    const Sights sights(mesh, views, gap_mm, options.threads);
    const SurfaceColors colors(mesh, sights, options.threads);
    TextureOptions how = *options.texture;
    how.threads = options.threads;
    auto textured = make_texture(mesh, sights, colors, how);
    if (!textured) return forward(textured);
    result.textured = *std::move(textured);
    options.after_stage("texture");
  }
  progress.report(1.0, "surface");
  return result;
}

Result<ReconstructedSurface> reconstruct_surface(std::span<const StereoView> views,
                                                 const SurfaceOptions& options,
                                                 const Progress& progress) {
  auto maps = find_depths(views, options, progress.part(0.02, 0.85));
  if (!maps) return forward(maps);
  return surface_of_depths(*std::move(maps), views, options, progress.part(0.85, 1.0));
}

}  // namespace skullstation
