#include "reconstruction/approximation/expected_features.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "reconstruction/anatomy/feature_rules.h"

namespace skullstation {

namespace {

using Eigen::Index;
using Eigen::Vector3d;

/// Landmarks of a fitted skull by name.
class Bones {
 public:
  Bones(const SkullTemplate& skull_template, const CaseSkull& skull)
      : template_(skull_template), skull_(skull) {}

  bool have(std::initializer_list<const char*> names, const std::string& side = "") const {
    return std::ranges::all_of(names, [&](const char* name) { return find(name + side); });
  }
  Vector3d at(const std::string& name) const { return find(name)->place.position(skull_.vertices); }
  /// As far as these landmarks may be off together [mm^2].
  double variance(std::initializer_list<const char*> names, const std::string& side = "") const {
    double sum = 0.0;
    for (const char* name : names) {
      const double sd = skull_.sd_mm[find(name + side)->place.corners[0]];
      sum += sd * sd;
    }
    return sum;
  }

 private:
  const TemplateLandmark* find(const std::string& name) const {
    const auto found = std::ranges::find(template_.landmarks, name, &TemplateLandmark::name);
    return found == template_.landmarks.end() ? nullptr : &*found;
  }

  const SkullTemplate& template_;
  const CaseSkull& skull_;
};

void add_nose(const Bones& bones, std::vector<ExpectedFeature>& features) {
  const auto of_nose = {"nasion", "acanthion", "rhinion", "subspinale"};
  if (!bones.have(of_nose) || !bones.have({"prosthion", "porion left", "porion right"})) return;
  const ExpectedNose nose = expected_nose(
      {bones.at("nasion"), bones.at("acanthion"), bones.at("rhinion"), bones.at("subspinale"),
       bones.at("prosthion"), bones.at("porion left"), bones.at("porion right")});
  ExpectedFeature tip;
  tip.source = "Rynn et al. 2010";
  tip.sd_mm = std::sqrt(kNoseRule_sd_mm * kNoseRule_sd_mm + bones.variance(of_nose));
  tip.origin = bones.at("nasion");
  tip.region = HeadRegion::nose;
  tip.facing = nose.forward;
  tip.name = "tip of the nose, before the nasion";
  tip.way = nose.forward;
  tip.expected_mm = nose.forward_mm;
  features.push_back(tip);
  tip.name = "tip of the nose, below the nasion";
  tip.way = nose.down;
  tip.expected_mm = nose.down_mm;
  features.push_back(tip);
}

void add_lid(const Bones& bones, const std::string& side, std::vector<ExpectedFeature>& features) {
  const auto of_orbit = {"dacryon", "ectoconchion", "mid-supraorbitale", "mid-infraorbitale"};
  if (!bones.have(of_orbit, side)) return;
  const Vector3d margin = bones.at("ectoconchion" + side);
  const Vector3d lid =
      expected_lid({bones.at("dacryon" + side), margin, bones.at("mid-supraorbitale" + side),
                    bones.at("mid-infraorbitale" + side)});
  ExpectedFeature feature;
  feature.name = "lid before the orbit's margin," + side;
  feature.source = "Stephan 2009";
  feature.sd_mm =
      std::sqrt(kEyeRule_sd_mm * kEyeRule_sd_mm + bones.variance({"ectoconchion"}, side));
  feature.way = feature.facing = -Vector3d::UnitY();
  feature.origin = {lid.x(), margin.y(), lid.z()};
  feature.expected_mm = margin.y() - lid.y();
  feature.region = HeadRegion::eyes;
  feature.on_line = true;
  features.push_back(feature);
}

/// The foremost vertex of the region.
SurfacePoint foremost(const ExpectedFeature& feature, const HeadTemplate& head_template,
                      const Points3& head) {
  SurfacePoint point;
  double farthest = -std::numeric_limits<double>::infinity();
  for (Index v = 0; v < head.rows(); ++v) {
    if (head_template.region[static_cast<std::size_t>(v)] != feature.region) continue;
    const double along = feature.facing.dot(head.row(v));
    if (along <= farthest) continue;
    farthest = along;
    point.corners.setConstant(static_cast<int>(v));
  }
  return point;
}

/// Where the line leaves the region's skin.
std::optional<SurfacePoint> on_line(const ExpectedFeature& feature,
                                    const HeadTemplate& head_template, const Points3& head) {
  std::optional<SurfacePoint> outermost;
  double farthest = -std::numeric_limits<double>::infinity();
  for (Index f = 0; f < head_template.triangles.rows(); ++f) {
    const Eigen::Vector3i corners = head_template.triangles.row(f);
    if (head_template.region[static_cast<std::size_t>(corners[0])] != feature.region) continue;
    // origin + t facing = weights . corners, the weights' sum being 1.
    Eigen::Matrix3d system;
    system << head.row(corners[1]).transpose() - head.row(corners[0]).transpose(),
        head.row(corners[2]).transpose() - head.row(corners[0]).transpose(), -feature.facing;
    const double volume = system.determinant();
    if (volume == 0.0) continue;
    const Vector3d solution =
        system.inverse() * (feature.origin - head.row(corners[0]).transpose());
    const Vector3d weights(1.0 - solution[0] - solution[1], solution[0], solution[1]);
    if (weights.minCoeff() < 0.0 || solution[2] <= farthest) continue;
    farthest = solution[2];
    outermost = SurfacePoint{corners, weights};
  }
  return outermost;
}

std::optional<SurfacePoint> point_of(const ExpectedFeature& feature,
                                     const HeadTemplate& head_template, const Points3& head) {
  if (feature.on_line) return on_line(feature, head_template, head);
  return foremost(feature, head_template, head);
}

/// Over which length soft parts move alike.
constexpr double soft_length_mm = 12.0;

double alike(const Vector3d& a, const Vector3d& b) {
  return std::exp((a - b).squaredNorm() / (-2.0 * soft_length_mm * soft_length_mm));
}

/// How far each vertex goes along with the skin at `place`, which goes by 1; those over bone stay.
Eigen::VectorXd going_along(const HeadTemplate& head_template, const Points3& head,
                            const Vector3d& place) {
  constexpr double reach_mm = 3.0 * soft_length_mm;
  constexpr std::size_t most_anchors = 200;
  std::vector<int> soft;
  std::vector<int> fixed;
  for (Index v = 0; v < head.rows(); ++v) {
    if ((head.row(v).transpose() - place).norm() > reach_mm) continue;
    const HeadRegion region = head_template.region[static_cast<std::size_t>(v)];
    (rests_on_bone(region) ? fixed : soft).push_back(static_cast<int>(v));
  }
  std::vector<Vector3d> anchors;
  for (std::size_t i = 0; i < fixed.size(); i += fixed.size() / most_anchors + 1) {
    anchors.emplace_back(head.row(fixed[i]));
  }
  const auto count = static_cast<Index>(anchors.size());
  const auto with_anchors = [&](const Vector3d& at) {
    Eigen::VectorXd covariance(count);
    for (Index i = 0; i < count; ++i) {
      covariance[i] = alike(at, anchors[static_cast<std::size_t>(i)]);
    }
    return covariance;
  };
  Eigen::MatrixXd inner(count, count);
  for (Index i = 0; i < count; ++i)
    inner.col(i) = with_anchors(anchors[static_cast<std::size_t>(i)]);
  inner.diagonal().array() += 0.01;
  const Eigen::VectorXd from_place = with_anchors(place);
  const Eigen::VectorXd weights = Eigen::LLT<Eigen::MatrixXd>(inner).solve(from_place);
  const double variance = 1.0 - weights.dot(from_place);
  Eigen::VectorXd along = Eigen::VectorXd::Zero(head.rows());
  for (const int v : soft) {
    const Vector3d at = head.row(v);
    along[v] = (alike(at, place) - weights.dot(with_anchors(at))) / variance;
  }
  return along;
}

}  // namespace

std::vector<ExpectedFeature> expected_features(const SkullTemplate& skull_template,
                                               const CaseSkull& skull) {
  const Bones bones(skull_template, skull);
  std::vector<ExpectedFeature> features;
  add_nose(bones, features);
  for (const char* side : {" left", " right"}) add_lid(bones, side, features);
  return features;
}

std::optional<double> feature_mm(const ExpectedFeature& feature, const HeadTemplate& head_template,
                                 const Points3& head) {
  const auto point = point_of(feature, head_template, head);
  if (!point) return std::nullopt;
  return feature.way.dot(point->position(head) - feature.origin);
}

std::optional<double> expected_mouth_width_mm(const SkullTemplate& skull_template,
                                              const CaseSkull& skull) {
  const Bones bones(skull_template, skull);
  if (!bones.have({"supra-canine left", "supra-canine right"})) return std::nullopt;
  return (bones.at("supra-canine left") - bones.at("supra-canine right")).norm() / kCaninesToMouth;
}

Points3 drawn_to_features(const HeadTemplate& head_template, Points3 head,
                          const Eigen::VectorXd& sd_mm,
                          const std::vector<ExpectedFeature>& features) {
  for (const ExpectedFeature& feature : features) {
    const auto point = point_of(feature, head_template, head);
    if (!point) continue;
    const Vector3d place = point->position(head);
    double sd = 0.0;
    for (int k = 0; k < 3; ++k) sd += point->weights[k] * sd_mm[point->corners[k]];
    const double missing_mm = feature.expected_mm - feature.way.dot(place - feature.origin);
    const double gain = sd * sd / (sd * sd + feature.sd_mm * feature.sd_mm);
    head += gain * missing_mm * going_along(head_template, head, place) * feature.way.transpose();
  }
  return head;
}

}  // namespace skullstation
