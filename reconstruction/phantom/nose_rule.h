#pragma once

#include <Eigen/Core>

namespace skullstation {

/// What the tip of the nose is foretold from; any frame [mm].
struct NoseBones {
  Eigen::Vector3d nasion, acanthion, rhinion, subspinale, prosthion, porion_left, porion_right;
};

/// Where the tip of the nose is to be expected (Rynn et al. 2010): so far along the line from
/// nasion to prosthion and so far forward, square to it; plus residuals in those directions.
Eigen::Vector3d expected_pronasale(const NoseBones& bones, double forward_residual_mm = 0.0,
                                   double down_residual_mm = 0.0);

/// The nasal wings are so much farther apart than the sides of the aperture.
inline constexpr double kAlarWings_mm = 10.0;
/// Distance between the upper canines' landmarks over the width of the mouth (Stephan & Henneberg
/// 2003).
inline constexpr double kCaninesToMouth = 0.758;

}  // namespace skullstation
