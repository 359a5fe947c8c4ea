#include "reconstruction/photogrammetry/sights.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/photogrammetry/mesh_depth.h"

namespace skullstation {

namespace {
/// Depth images are rendered at 1 / 2^level of the views' size.
constexpr int kDepthLevel = 1;
}  // namespace

Sights::Sights(const TriangleMesh& mesh, std::span<const StereoView> views, double gap_mm,
               int threads)
    : views_(views), gap_mm_(gap_mm), inverse_depth_(views.size()) {
  for (const StereoView& view : views) centres_.push_back(view.centre_mm());
  parallel_for(static_cast<int>(views.size()), threads, [&](int v) {
    inverse_depth_[v] = rendered_inverse_depth(mesh, views[v].camera.reduced(kDepthLevel),
                                               views[v].camera_from_table);
  });
}

std::optional<Sight> Sights::of(std::size_t v, const Eigen::Vector3d& point,
                                const Eigen::Vector3d& normal) const {
  static const double least_cosine = std::cos(radians(80.0));
  Sight sight;
  sight.direction = (centres_[v] - point).normalized();
  sight.cosine = sight.direction.dot(normal);
  if (sight.cosine < least_cosine) return std::nullopt;
  const StereoView& view = views_[v];
  const Eigen::Vector3d x_camera = view.camera_from_table * point;
  if (x_camera.z() <= 1.0) return std::nullopt;
  sight.depth_mm = x_camera.z();
  sight.pixel = view.camera.project(x_camera);
  const auto column = static_cast<int>(std::floor(sight.pixel.x()));
  const auto row = static_cast<int>(std::floor(sight.pixel.y()));
  if (column < 0 || row < 0 || column >= view.mask.width || row >= view.mask.height ||
      view.mask.at(column, row) < 128) {
    return std::nullopt;
  }
  const ImageF& rendered = inverse_depth_[v];
  const int x = std::min(column >> kDepthLevel, rendered.width - 1);
  const int y = std::min(row >> kDepthLevel, rendered.height - 1);
  const float w = rendered.at(x, y);
  // Within a pixel the depth of a slanted surface changes.
  const double pixel_mm = (1 << kDepthLevel) * sight.depth_mm / view.camera.fx;
  const double gap_mm = gap_mm_ + pixel_mm / sight.cosine;
  if (w > 0.0f && 1.0 / w < sight.depth_mm - gap_mm) return std::nullopt;
  return sight;
}

}  // namespace skullstation
