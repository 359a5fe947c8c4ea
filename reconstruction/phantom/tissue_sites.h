#pragma once

#include <Eigen/Core>
#include <limits>
#include <span>
#include <vector>

#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

/// A point of the bone; `distance_mm` is infinite where none is near enough.
struct NearestBone {
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double distance_mm = std::numeric_limits<double>::infinity();
  bool on_mandible = false;
};

/// The canonical skull's surface, whose mandible may be turned open.
class CanonicalBone {
 public:
  explicit CanonicalBone(const SkullMeshes& skull);

  NearestBone nearest(const Eigen::Vector3d& query, const Rigid3& open_from_closed = {},
                      double max_distance_mm = std::numeric_limits<double>::infinity()) const;

 private:
  TriangleBvh cranium_;
  TriangleBvh mandible_;
};

/// A place of the canonical skin where the tissue's thickness is steered [mm].
struct TissueSite {
  Eigen::Vector3d skin;
  Eigen::Vector3d bone;  ///< nearest to it
  double depth_mm = 0.0;
  bool on_mandible = false;
  bool on_vault = false;
};

/// Places spread over the canonical skin, closest where it is thinnest; none farther than 28 mm
/// from bone, nor, about the ears, farther than 9 mm: of the auricle the nearest bone says nothing.
std::vector<TissueSite> tissue_sites(const TriangleMesh& skin, const CanonicalBone& bone,
                                     const Eigen::Vector3d& left_ear);

/// Carries logarithms of thickness ratios from where they are known to the sites: a Gaussian
/// process (simple kriging) with a common part, one of 60 mm and one of 25 mm range. Ratios stay
/// positive, whatever is drawn. #sites x #known.
Eigen::MatrixXd log_ratio_kriging(std::span<const Eigen::Vector3d> known,
                                  std::span<const Eigen::Vector3d> sites);

/// How far a skin point that has moved from `start` to `end` [mm] keeps off the bone; negative, by
/// what remained of the way, if it passed through the bone.
struct Clearance {
  double distance_mm = 0.0;
  Eigen::Vector3d bone = Eigen::Vector3d::Zero();  ///< nearest to the end, or where it passed
};
Clearance clearance(const CanonicalBone& bone, const Rigid3& open_from_closed,
                    const Eigen::Vector3d& start, const Eigen::Vector3d& end);

}  // namespace skullstation
