#include "reconstruction/phantom/bone_warp.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "core/random.h"
#include "reconstruction/phantom/craniometric_table.h"
#include "reconstruction/phantom/tissue_targets.h"
#include "reconstruction/phantom/warp_conditioning.h"

namespace skullstation {

using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kLeastDeterminant = 0.2;
constexpr int kMostShrinkings = 12;

/// The finest bumps lie where bones are small: in the face, the jaw and the base.
WarpBasisOptions bone_basis() {
  WarpBasisOptions options;
  options.stretch_sd = 0.15;
  const auto everywhere = [](const Vector3d&) { return true; };
  const auto below_vault = [](const Vector3d& center) {
    return center.y() < 60.0 && center.z() < 60.0;
  };
  const auto face = [](const Vector3d& center) { return center.y() < 30.0 && center.z() < 50.0; };
  const auto nose = [](const Vector3d& center) {
    return center.x() < 40.0 && center.y() < -50.0 && center.z() > -35.0 && center.z() < 50.0;
  };
  options.layers = {{.spacing_mm = 80.0, .width_mm = 80.0, .sd_mm = 5.0, .covers = everywhere},
                    {.spacing_mm = 50.0, .width_mm = 50.0, .sd_mm = 2.5, .covers = below_vault},
                    {.spacing_mm = 26.0, .width_mm = 26.0, .sd_mm = 1.6, .covers = face},
                    {.spacing_mm = 15.0, .width_mm = 15.0, .sd_mm = 1.0, .covers = nose}};
  return options;
}

struct ExtremeRule {
  std::string_view name;
  double direction[3];
  double radius_mm;
  bool median;
};

constexpr ExtremeRule kExtremes[] = {
    {"euryon left", {1, 0, 0}, 45.0, false},   {"euryon right", {-1, 0, 0}, 45.0, false},
    {"zygion left", {1, 0, 0}, 20.0, false},   {"zygion right", {-1, 0, 0}, 20.0, false},
    {"opisthocranion", {0, 1, 0}, 35.0, true}, {"vertex", {0, 0, 1}, 45.0, true},
};

ShapeMeasure shape_measure(const Craniometric& craniometric, const std::vector<Landmark>& order) {
  const int from = landmark_index(order, craniometric.from);
  const int to = landmark_index(order, craniometric.to);
  if (craniometric.code == "MDH") {
    return {std::string(craniometric.code), {from, to}, [](std::span<const Vector3d> points) {
              return points[0].z() - points[1].z();
            }};
  }
  if (!craniometric.subtense_of.empty()) {
    const int apex = landmark_index(order, craniometric.subtense_of);
    return {std::string(craniometric.code), {from, to, apex}, [](std::span<const Vector3d> points) {
              const Vector3d along = (points[1] - points[0]).normalized();
              return (points[2] - points[0]).cross(along).norm();
            }};
  }
  return length_measure(std::string(craniometric.code), from, to);
}

std::vector<Vector3d> positions(const std::vector<Landmark>& landmarks) {
  std::vector<Vector3d> points;
  points.reserve(landmarks.size());
  for (const Landmark& landmark : landmarks) points.push_back(landmark.position_mm);
  return points;
}

}  // namespace

int landmark_index(const std::vector<Landmark>& landmarks, std::string_view name) {
  const auto found = std::ranges::find(landmarks, name, &Landmark::name);
  assert(found != landmarks.end());
  return static_cast<int>(found - landmarks.begin());
}

Eigen::AlignedBox3d head_box() { return {Vector3d(-85, -115, -90), Vector3d(85, 115, 130)}; }

std::vector<double> craniometrics(const std::vector<Landmark>& landmarks) {
  const std::vector<Vector3d> points = positions(landmarks);
  std::vector<double> measures;
  for (const Craniometric& craniometric : craniometric_table()) {
    measures.push_back(measured(shape_measure(craniometric, landmarks), points));
  }
  return measures;
}

Rigid3 into_frankfurt_plane(const std::vector<Landmark>& landmarks) {
  const auto at = [&](std::string_view name) {
    return landmarks[landmark_index(landmarks, name)].position_mm;
  };
  const Vector3d origin = 0.5 * (at("porion left") + at("porion right"));
  const Vector3d forward = 0.5 * (at("orbitale left") + at("orbitale right")) - origin;
  Eigen::Matrix3d axes;  // rows: x, y, z of the new frame
  axes.row(0) = (at("porion left") - at("porion right")).normalized();
  axes.row(2) = forward.cross(axes.row(0).transpose()).normalized();
  axes.row(1) = axes.row(2).transpose().cross(axes.row(0).transpose());
  const Eigen::Quaterniond turn(axes);
  return {turn, -(turn * origin)};
}

void open_mandible(BoneWarp& bone, double opening_deg) {
  bone.open_from_closed = mandible_opening(opening_deg);
  for (std::size_t i = 0; i < bone.landmarks.size(); ++i) {
    if (!bone.landmarks[i].on_mandible) continue;
    bone.canonical_mm[i] = bone.open_from_closed * bone.canonical_mm[i];
    bone.landmarks[i].position_mm = bone.person_from_canonical(bone.canonical_mm[i]);
  }
}

BoneWarpModel::BoneWarpModel(std::vector<Landmark> canonical, const TriangleMesh& cranium,
                             std::vector<Landmark> skin)
    : canonical_(std::move(canonical)), skin_(std::move(skin)), basis_(head_box(), bone_basis()) {
  for (const ExtremeRule& rule : kExtremes) {
    Extreme extreme;
    extreme.landmark = landmark_index(canonical_, rule.name);
    extreme.direction = Vector3d(rule.direction);
    const Vector3d center = canonical_[extreme.landmark].position_mm;
    for (Eigen::Index v = 0; v < cranium.vertices.rows(); ++v) {
      Vector3d point = cranium.vertices.row(v);
      if (rule.median && std::abs(point.x()) > 3.0) continue;
      if ((point - center).norm() > rule.radius_mm) continue;
      // Only what faces that way can be an extreme, also after a gentle warp.
      if (cranium.normals.row(v).dot(extreme.direction) < 0.5) continue;
      if (rule.median) point.x() = 0.0;
      extreme.candidates.push_back(point);
    }
    extremes_.push_back(std::move(extreme));
  }
}

BoneWarp BoneWarpModel::fit_once(const std::vector<double>& measures_mm,
                                 const VectorXd& start) const {
  std::vector<Vector3d> points = positions(canonical_);
  std::vector<WarpTarget> targets = tissue_targets(canonical_, skin_);
  for (const Landmark& landmark : skin_) points.push_back(landmark.position_mm);
  const auto table = craniometric_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    targets.push_back({shape_measure(table[i], canonical_), measures_mm[i], 0.15});
  }
  const auto index = [&](std::string_view name) { return landmark_index(canonical_, name); };
  const std::vector<int> porions = {index("porion left"), index("porion right")};
  const std::vector<int> orbitalia = {index("orbitale left"), index("orbitale right")};
  targets.push_back({coordinate_measure("origin y", porions, 1), 0.0, 0.1});
  targets.push_back({coordinate_measure("origin z", porions, 2), 0.0, 0.1});
  targets.push_back({coordinate_measure("Frankfurt plane", orbitalia, 2), 0.0, 0.1});

  BoneWarp bone;
  // Once the skull has its measures, another point may be the broadest: found anew, and fitted.
  for (int round = 0; round < 3; ++round) {
    const ConditionedWarp fitted = condition_warp(basis_, points, targets, start);
    bone.person_from_canonical = basis_.warp(fitted.coefficients);
    for (const Extreme& extreme : extremes_) {
      double farthest = extreme.direction.dot(bone.person_from_canonical(points[extreme.landmark]));
      for (const Vector3d& candidate : extreme.candidates) {
        const double height = extreme.direction.dot(bone.person_from_canonical(candidate));
        if (height <= farthest) continue;
        farthest = height;
        points[extreme.landmark] = candidate;
      }
    }
  }
  points.resize(canonical_.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    bone.landmarks.push_back(
        {canonical_[i].name, bone.person_from_canonical(points[i]), canonical_[i].on_mandible});
  }
  bone.person_from_canonical.motion = into_frankfurt_plane(bone.landmarks);
  for (Landmark& landmark : bone.landmarks) {
    landmark.position_mm = bone.person_from_canonical.motion * landmark.position_mm;
  }
  bone.measures_mm = craniometrics(bone.landmarks);
  bone.canonical_mm = std::move(points);
  return bone;
}

BoneWarp BoneWarpModel::fit(const std::vector<double>& measures_mm, std::uint64_t seed,
                            double freedom, int threads) const {
  Random random(seed);
  VectorXd start(basis_.size());
  for (Eigen::Index i = 0; i < start.size(); ++i) start[i] = freedom * random.normal();
  // Size and proportions are the measures' to say: chance ones would stretch what is not measured.
  start.head(WarpBasis::kAffineModes).setZero();
  const std::vector<double> own = craniometrics(canonical_);
  std::vector<double> wanted = measures_mm;
  for (int shrinkings = 0;; ++shrinkings) {
    BoneWarp bone = fit_once(wanted, start);
    bone.shrinkings = shrinkings;
    bone.least_determinant =
        least_determinant(bone.person_from_canonical, head_box(), 12.0, threads);
    if (bone.least_determinant > kLeastDeterminant || shrinkings == kMostShrinkings) return bone;
    start *= 0.8;
    if (shrinkings < 3) continue;
    for (std::size_t i = 0; i < wanted.size(); ++i) wanted[i] += 0.1 * (own[i] - wanted[i]);
  }
}

}  // namespace skullstation
