#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <span>

#include "core/triangle_mesh.h"

namespace skullstation {

struct RayHit {
  double distance_mm = 0.0;
  int mesh = 0;
  int triangle = 0;
  double u = 0.0;  ///< barycentric weight of the triangle's second corner
  double v = 0.0;  ///< of its third
};

/// Triangles ready for rays (Embree). Safe to query from several threads. The meshes may go.
class RayScene {
 public:
  /// \pre all indices are in range
  explicit RayScene(std::span<const TriangleMesh* const> meshes);
  ~RayScene();
  RayScene(const RayScene&) = delete;
  RayScene& operator=(const RayScene&) = delete;

  /// The first hit farther than `nearest_mm` along the unit direction.
  std::optional<RayHit> first_hit(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                  double nearest_mm = 0.0) const;

  bool blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
               double farthest_mm) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace skullstation
