#pragma once

#include <Eigen/Core>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/bone_warp.h"
#include "reconstruction/phantom/person_parameters.h"
#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/phantom/space_warp.h"
#include "reconstruction/phantom/warp_basis.h"

namespace skullstation {

/// A person's skin: the canonical skin, carried along by the bone's warp, then moved by this one.
struct FaceWarp {
  SpaceWarp person_from_carried;
  std::vector<Landmark> landmarks;          ///< the person's, on the skin, in the canonical order
  std::vector<ThicknessPair> thickness_mm;  ///< of thickness_table(), between the landmarks
  double least_thickness_mm = 0.0;          ///< anywhere on the head
  double least_determinant = 1.0;
  int shrinkings = 0;  ///< how often the draw had to be moved towards the canonical face
};

/// Finds faces of given thicknesses over given skulls.
class FaceWarpModel {
 public:
  /// All canonical: the skin's landmarks, its mesh (4 mm or so will do), the mesh of both bones.
  FaceWarpModel(std::vector<Landmark> skin_landmarks, TriangleMesh skin, const TriangleMesh& bone);

  /// The skin over the person's skull `bone` (its mesh in the person's frame, both bones) with the
  /// thickness of the parameters at every landmark pair, measured from landmark to landmark, and
  /// with the nose, mouth and ears that the bone foretells plus the parameters' residuals:
  /// pronasale after Rynn et al. 2010, nasal wings 5 mm beside the aperture, mouth width the
  /// intercanine distance / 0.758 (Stephan & Henneberg 2003), ears of 62 mm (men) and 58 mm (women)
  /// at 45 years that grow by 0.22 mm a year (Heathcote 1995). Where the skin would come closer
  /// than 1 mm to the bone it is kept off. A draw that still does, or folds, is moved towards the
  /// canonical face step by step, and says so.
  FaceWarp fit(const PersonParameters& person, const BoneWarp& bone_warp, const TriangleMesh& bone,
               int threads) const;

 private:
  struct Carried;
  FaceWarp fit_once(const PersonParameters& person, const BoneWarp& bone_warp,
                    const Carried& carried, double share, int threads) const;

  std::vector<Landmark> canonical_;
  TriangleMesh skin_;
  Points3 beneath_;         ///< the bone nearest to each vertex of skin_
  std::vector<int> scalp_;  ///< vertices of skin_ spread over the vault
  WarpBasis basis_;
};

}  // namespace skullstation
