#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <vector>

#include "core/image.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// How one view sees a point of the surface.
struct Sight {
  Eigen::Vector2d pixel;      ///< in the view's image
  Eigen::Vector3d direction;  ///< unit, from the point to the camera
  double cosine = 0.0;        ///< between that and the normal
  double depth_mm = 0.0;      ///< along the camera's axis
};

/// Tells which views see a point of a surface: those that it faces (less than 80 deg off its
/// normal), whose masks show specimen there and before which no other part of it stands, by depth
/// images of the surface itself.
class Sights {
 public:
  /// What lies less than `gap_mm` behind the nearest surface counts as seen. `views` must outlive
  /// this.
  Sights(const TriangleMesh& mesh, std::span<const StereoView> views, double gap_mm, int threads);

  std::optional<Sight> of(std::size_t view, const Eigen::Vector3d& point,
                          const Eigen::Vector3d& normal) const;
  std::span<const StereoView> views() const { return views_; }

 private:
  std::span<const StereoView> views_;
  double gap_mm_;
  std::vector<ImageF> inverse_depth_;  ///< at half the views' size
  std::vector<Eigen::Vector3d> centres_;
};

}  // namespace skullstation
