#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>

#include "capture/simulation/shading_mesh.h"
#include "core/result.h"

namespace skullstation {

/// A ray in specimen coordinates [mm]; the direction has unit length.
struct SpecimenRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;
  double limit_mm = 0.0;  ///< nothing beyond is of interest
};

struct SpecimenHit {
  int triangle = -1;  ///< -1: the ray misses
  double distance_mm = 0.0;
  double b = 0.0, c = 0.0;  ///< barycentric weights of the triangle's second and third corner
};

/// The specimen in Embree (Wald et al. 2014). Embree finds the triangle in single precision,
/// relative to the middle of the specimen and from where the ray enters its bounding sphere; the
/// point on it is then solved in double precision.
class SpecimenSurface {
 public:
  static Result<std::shared_ptr<const SpecimenSurface>> build(ShadingMesh mesh);

  const ShadingMesh& mesh() const { return mesh_; }

  /// First hits. `hits` is as long as `rays`.
  void intersect(std::span<const SpecimenRay> rays, std::span<SpecimenHit> hits) const;

  /// 1 where something lies between the ray's origin and its limit. `blocked` is as long as
  /// `rays`.
  void occluded(std::span<const SpecimenRay> rays, std::span<std::uint8_t> blocked) const;

  ~SpecimenSurface();
  SpecimenSurface(const SpecimenSurface&) = delete;
  SpecimenSurface& operator=(const SpecimenSurface&) = delete;

 private:
  struct EmbreeScene;
  SpecimenSurface(ShadingMesh mesh, std::unique_ptr<EmbreeScene> embree,
                  const Eigen::Vector3d& centre, double radius_mm);
  /// Where the ray enters and leaves the bounding sphere, within its limits; false if it does not.
  bool clip(const SpecimenRay& ray, double& begin_mm, double& end_mm) const;

  ShadingMesh mesh_;
  std::unique_ptr<EmbreeScene> embree_;
  Eigen::Vector3d centre_;
  double radius_mm_;
};

}  // namespace skullstation
