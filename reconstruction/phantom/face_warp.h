#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/bone_warp.h"
#include "reconstruction/phantom/person_parameters.h"
#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/phantom/space_warp.h"
#include "reconstruction/phantom/thickness_table.h"
#include "reconstruction/phantom/tissue_sites.h"
#include "reconstruction/phantom/warp_basis.h"

namespace skullstation {

/// A person's skin: the canonical one, moved by this warp over the canonical skull and then carried
/// along by the bone's warp.
struct FaceWarp {
  SpaceWarp face_from_canonical;
  std::vector<Landmark> landmarks;          ///< the person's, on the skin, in the canonical order
  std::vector<ThicknessPair> thickness_mm;  ///< of thickness_table(), between the landmarks
  double least_thickness_mm = 0.0;          ///< anywhere on the head
  double least_determinant = 1.0;
  int shrinkings = 0;  ///< how often the draw had to be moved towards the canonical face
};

/// Finds faces of given thicknesses over given skulls.
class FaceWarpModel {
 public:
  /// All canonical: the skull with its landmarks, the skin (edges of 2.5 mm) with its own.
  FaceWarpModel(const SkullMeshes& skull, std::vector<Landmark> bone_landmarks, TriangleMesh skin,
                std::vector<Landmark> skin_landmarks);

  /// The skin over the person's skull with the thickness of the parameters at every landmark pair,
  /// measured from landmark to landmark, and with the nose, mouth and ears that the bone foretells
  /// plus the parameters' residuals: pronasale after Rynn et al. 2010, nasal wings 5 mm beside the
  /// aperture, mouth width the intercanine distance / 0.758 (Stephan & Henneberg 2003), ears of
  /// 62 mm (men) and 58 mm (women) at 45 years that grow by 0.22 mm a year (Heathcote 1995).
  /// Between the landmarks the ratio of thickness to the canonical one varies smoothly. Nowhere
  /// does the skin come closer than 1.5 mm to the bone: thicknesses are bent off from below 2 mm,
  /// and a draw that still comes too close, or folds, is moved towards the canonical face step by
  /// step, and says so. The mandible and what lies on it are turned open by the parameters' angle.
  FaceWarp fit(const PersonParameters& person, const BoneWarp& bone, int threads) const;

 private:
  class Fit;

  CanonicalBone bone_;
  std::vector<Landmark> bone_landmarks_;
  TriangleMesh skin_;
  TriangleBvh skin_surface_;
  std::vector<Landmark> skin_landmarks_;
  std::vector<TissueSite> sites_;
  std::vector<int> watched_;                  ///< vertices of skin_ that might come close to bone
  std::vector<std::vector<int>> sites_near_;  ///< each watched vertex
  WarpBasis basis_;
  Eigen::MatrixXd site_rows_;  ///< #sites x #basis: displacement away from the bone
  Eigen::MatrixXd site_gram_;  ///< site_rows_ times its transpose
};

}  // namespace skullstation
