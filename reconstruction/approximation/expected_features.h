#pragma once

#include <optional>
#include <string>
#include <vector>

#include "reconstruction/approximation/case_skull.h"
#include "reconstruction/registration/head_template.h"

namespace skullstation {

/// Where a published rule expects a feature that no bone carries: how far along a direction.
struct ExpectedFeature {
  std::string name;
  std::string source;        ///< author and year
  double expected_mm = 0.0;  ///< (point - origin) . way
  double sd_mm = 0.0;        ///< of the rule and of the bones that it starts from
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  Eigen::Vector3d way = Eigen::Vector3d::Zero();
  /// Which point of the head is meant: of this region's skin the foremost in this direction, or the
  /// one that a line from the origin in this direction passes through.
  HeadRegion region = HeadRegion::nose;
  Eigen::Vector3d facing = Eigen::Vector3d::Zero();
  bool on_line = false;
};

/// Tip of the nose and lids as reconstruction/anatomy/feature_rules.h foretells them from the
/// fitted skull's landmarks; without the rules whose landmarks the template has not. Landmarks of
/// the head's skin are not asked for: skin slides along itself when heads are registered, and a
/// fitted head's tip of the nose is where it is, not where the template's was. That is why the
/// mouth's rule is not among them: nothing tells where a closed mouth ends.
std::vector<ExpectedFeature> expected_features(const SkullTemplate& skull_template,
                                               const CaseSkull& skull);

/// How far the head's point is along the way; nothing where the line misses the region.
std::optional<double> feature_mm(const ExpectedFeature& feature, const HeadTemplate& head_template,
                                 const Points3& head);

/// The width of the mouth by the canines, for who reads the report (Stephan & Henneberg 2003).
std::optional<double> expected_mouth_width_mm(const SkullTemplate& skull_template,
                                              const CaseSkull& skull);

/// The head (template's vertices x 3) with its features drawn to where they are expected: as far as
/// the rules are more certain than the face is (`sd_mm`, of its vertices along their normals). What
/// no bone carries goes along with a feature the less the farther away it lies, as in a Gaussian
/// process that is known to be 0 where skin rests on bone.
Points3 drawn_to_features(const HeadTemplate& head_template, Points3 head,
                          const Eigen::VectorXd& sd_mm,
                          const std::vector<ExpectedFeature>& features);

}  // namespace skullstation
