#pragma once

#include <Eigen/Core>

namespace skullstation {

// Published rules that foretell from bone what no bone carries. All in mm.

/// What the tip of the nose is foretold from; any frame.
struct NoseBones {
  Eigen::Vector3d nasion, acanthion, rhinion, subspinale, prosthion, porion_left, porion_right;
};

/// Where to expect the tip of the nose, seen from the nasion (Rynn et al. 2010).
struct ExpectedNose {
  Eigen::Vector3d down;     ///< unit, from nasion to prosthion
  Eigen::Vector3d forward;  ///< unit, square to it and to the line between the ears
  double down_mm = 0.0;
  double forward_mm = 0.0;
};
ExpectedNose expected_nose(const NoseBones& bones);
/// The rule's mean error is 2.2 mm (Mala 2013, 86 Central Europeans), which a Gaussian of this
/// standard deviation has; over twice as much in populations that it was not made for.
inline constexpr double kNoseRule_sd_mm = 2.8;

/// The tip itself, residuals added in those directions.
Eigen::Vector3d expected_pronasale(const NoseBones& bones, double forward_residual_mm = 0.0,
                                   double down_residual_mm = 0.0);

/// The nasal wings are so much farther apart than the sides of the aperture.
inline constexpr double kAlarWings_mm = 10.0;

/// Distance between the upper canines' landmarks over the width of the mouth (Stephan & Henneberg
/// 2003, 93 people).
inline constexpr double kCaninesToMouth = 0.758;

/// An orbit's margin; anatomical frame (x to the left, y backwards, z up).
struct OrbitBones {
  Eigen::Vector3d dacryon;       ///< where the medial margin ends
  Eigen::Vector3d ectoconchion;  ///< the deepest point of the lateral margin
  Eigen::Vector3d above, below;  ///< middle of the upper and of the lower margin
};

/// The foremost point of the closed lid: the eyeball lies 1.4 mm higher and 2.3 mm farther to the
/// side than the orbit's middle, the cornea 16 mm before the lateral margin (Stephan 2009, 13
/// people), under 2 mm of lid.
Eigen::Vector3d expected_lid(const OrbitBones& bones);
/// How much eyes protrude differently in people of one kind (exophthalmometry); the rule's own
/// paper has too few people to say.
inline constexpr double kEyeRule_sd_mm = 2.5;

}  // namespace skullstation
