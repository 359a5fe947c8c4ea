#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string_view>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/skull_landmarks.h"
#include "reconstruction/phantom/space_warp.h"
#include "reconstruction/phantom/warp_basis.h"

namespace skullstation {

/// Index of the landmark of that name.
/// \pre it is there
int landmark_index(const std::vector<Landmark>& landmarks, std::string_view name);

/// A person's skull as a deformation of the canonical one.
struct BoneWarp {
  SpaceWarp person_from_canonical;  ///< ends in the person's own anatomical frame
  Rigid3 open_from_closed;          ///< how the canonical mandible is turned before it is warped

  /// Where a point of the canonical skull, its mandible closed, lies on the person.
  Eigen::Vector3d on_person(const Eigen::Vector3d& canonical, bool on_mandible) const {
    return person_from_canonical(on_mandible ? open_from_closed * canonical : canonical);
  }

  std::vector<Landmark> landmarks;  ///< the person's, in the canonical order
  /// Where each landmark lies on the canonical skull: extremes are others than the canonical ones.
  std::vector<Eigen::Vector3d> canonical_mm;
  std::vector<double> measures_mm;  ///< of craniometric_table(), taken from those landmarks
  double least_determinant = 1.0;
  /// How often the draw had to be moved towards the likeliest one until it folded nowhere.
  int shrinkings = 0;
};

/// Finds skulls of given measures.
class BoneWarpModel {
 public:
  /// `cranium` is the canonical one, on which landmarks defined as extremes are found anew for
  /// every person; a mesh of 2 or 3 mm is fine enough. `skin` are the canonical skin's landmarks:
  /// the warp also carries the skin, so the likeliest warp is one that, besides, changes the
  /// thickness of tissue little and leaves nose and mouth where the bone foretells them.
  BoneWarpModel(std::vector<Landmark> canonical, const TriangleMesh& cranium,
                std::vector<Landmark> skin);

  /// The skull with the given measures [mm] (one each of craniometric_table()) that is nearest to a
  /// draw of the prior deformation: `freedom` times standard normal coefficients from `seed`; with
  /// `freedom` 0 the likeliest skull of those measures. Landmarks that are extremes (euryon,
  /// zygion, opisthocranion, vertex) are the extremes of the person's own skull. Draws
  /// whose warp's Jacobian determinant falls to 0.2 or below anywhere in the head are moved towards
  /// the likeliest skull step by step, in its freedom and its measures, and say so.
  BoneWarp fit(const std::vector<double>& measures_mm, std::uint64_t seed, double freedom,
               int threads) const;

 private:
  struct Extreme {
    int landmark = 0;
    std::vector<Eigen::Vector3d> candidates;
    Eigen::Vector3d direction;
  };
  BoneWarp fit_once(const std::vector<double>& measures_mm, const Eigen::VectorXd& start) const;

  std::vector<Landmark> canonical_;
  std::vector<Landmark> skin_;
  std::vector<Extreme> extremes_;
  WarpBasis basis_;
};

/// Turns the mandible, with its landmarks, open by `opening_deg` in [0, 35]. The measures stay
/// those with the teeth in contact.
void open_mandible(BoneWarp& bone, double opening_deg);

/// The part of space a head takes up, in the anatomical frame.
Eigen::AlignedBox3d head_box();

/// The measures of craniometric_table() of a skull with those landmarks (canonical names) [mm].
std::vector<double> craniometrics(const std::vector<Landmark>& landmarks);

/// Turns and shifts the landmarks into their own anatomical frame: frankfurt_from_given.
Rigid3 into_frankfurt_plane(const std::vector<Landmark>& landmarks);

}  // namespace skullstation
