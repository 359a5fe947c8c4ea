#include "reconstruction/phantom/face_warp.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/thickness_table.h"
#include "reconstruction/phantom/warp_conditioning.h"

namespace skullstation {

using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kLeastDeterminant = 0.15;
constexpr double kLeastThickness_mm = 1.0;
constexpr int kMostShrinkings = 5;
/// No face warp sinks the skin deeper into the bone than this.
constexpr double kDeepest_mm = 3.5;
constexpr double kScalpSpacing_mm = 28.0;
constexpr int kPressRounds = 6;

WarpBasisOptions face_basis() {
  WarpBasisOptions options;
  options.stretch_sd = 0.02;
  options.shift_sd_mm = 1.0;
  options.layers = {
      {.spacing_mm = 45.0,
       .width_mm = 45.0,
       .sd_mm = 2.0,
       .covers = [](const Vector3d&) { return true; }},
      {.spacing_mm = 24.0,
       .width_mm = 24.0,
       .sd_mm = 1.5,
       .covers = [](const Vector3d& center) { return center.y() < 20.0 && center.z() < 60.0; }},
      {.spacing_mm = 14.0, .width_mm = 14.0, .sd_mm = 0.8, .covers = [](const Vector3d& center) {
         return center.y() < -60.0 && center.x() < 45.0 && center.z() < 50.0;
       }}};
  return options;
}

Vector3d at(const std::vector<Landmark>& landmarks, std::string_view name) {
  return landmarks[landmark_index(landmarks, name)].position_mm;
}

/// Where the tip of the nose is to be expected (Rynn et al. 2010): along the line from nasion to
/// prosthion and forward, square to it.
Vector3d expected_pronasale(const std::vector<Landmark>& bone, const FeatureResiduals& residuals) {
  const Vector3d nasion = at(bone, "nasion");
  const double x = (nasion - at(bone, "acanthion")).norm();
  const double y = (at(bone, "rhinion") - at(bone, "subspinale")).norm();
  const Vector3d down = (at(bone, "prosthion") - nasion).normalized();
  const Vector3d across = (at(bone, "porion left") - at(bone, "porion right")).normalized();
  const Vector3d forward = down.cross(across).normalized();
  return nasion + (0.9 * x - 2.0 + residuals.pronasale_down_mm) * down +
         (0.83 * y - 3.5 + residuals.pronasale_forward_mm) * forward;
}

}  // namespace

/// What the bone's warp makes of the canonical skin, and the bone beneath it.
struct FaceWarpModel::Carried {
  std::vector<Vector3d> landmarks;
  Points3 skin;
  Points3 beneath;  ///< the bone that is nearest to each vertex of the canonical skin
  const TriangleBvh* bone = nullptr;
};

FaceWarpModel::FaceWarpModel(std::vector<Landmark> skin_landmarks, TriangleMesh skin,
                             const TriangleMesh& bone)
    : canonical_(std::move(skin_landmarks)),
      skin_(std::move(skin)),
      basis_(head_box(), face_basis()) {
  const TriangleBvh tree(bone);
  beneath_.resize(skin_.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < skin_.vertices.rows(); ++v) {
    const Vector3d place = skin_.vertices.row(v);
    beneath_.row(v) = tree.closest(place).point.transpose();
    const bool on_vault = place.z() > 65.0 || (place.y() > 40.0 && place.z() > 10.0);
    const auto near = [&](int other) {
      return (place - Vector3d(skin_.vertices.row(other))).norm() < kScalpSpacing_mm;
    };
    if (on_vault && std::ranges::none_of(scalp_, near)) scalp_.push_back(static_cast<int>(v));
  }
}

FaceWarp FaceWarpModel::fit_once(const PersonParameters& person, const BoneWarp& bone_warp,
                                 const Carried& carried, double share, int threads) const {
  const auto& bone = bone_warp.landmarks;
  std::vector<Vector3d> points = carried.landmarks;
  std::vector<WarpTarget> targets;
  const auto index = [&](const std::string& name) { return landmark_index(canonical_, name); };
  // Towards the canonical face: each target goes from its wanted value to the one it has.
  const auto want = [&](ShapeMeasure measure, double value, double tolerance) {
    const double own = measured(measure, points);
    targets.push_back({std::move(measure), own + share * (value - own), tolerance});
  };
  const auto pair_names = [&](const TissueThickness& row) {
    std::vector<std::pair<std::string, std::string>> names;
    const std::string skin = std::string(row.bone) + " skin";
    if (!row.bilateral) return std::vector{std::pair{std::string(row.bone), skin}};
    return std::vector{std::pair{std::string(row.bone) + " left", skin + " left"},
                       std::pair{std::string(row.bone) + " right", skin + " right"}};
  };
  const auto table = thickness_table();
  const auto wanted_at = [&](std::string_view bone_name) {
    const auto row = std::ranges::find(table, bone_name, &TissueThickness::bone);
    return person.thickness_mm[row - table.begin()].left_mm;
  };
  for (std::size_t i = 0; i < table.size(); ++i) {
    const auto names = pair_names(table[i]);
    for (std::size_t side = 0; side < names.size(); ++side) {
      const ThicknessPair& wanted = person.thickness_mm[i];
      want(reach_measure(std::string(table[i].pair), index(names[side].second),
                         at(bone, names[side].first)),
           side == 0 ? wanted.left_mm : wanted.right_mm, 0.02);
    }
  }
  // The scalp is about as thick everywhere as at the vertex and the opisthocranion.
  const double scalp_mm = std::sqrt(wanted_at("vertex") * wanted_at("opisthocranion"));
  for (const int v : scalp_) {
    points.push_back(carried.skin.row(v));
    want(reach_measure("scalp", static_cast<int>(points.size()) - 1, carried.beneath.row(v)),
         scalp_mm, 0.3);
  }
  const FeatureResiduals& features = person.features;
  const Vector3d pronasale = expected_pronasale(bone, features);
  for (int axis = 1; axis < 3; ++axis) {
    want(coordinate_measure("pronasale", {index("pronasale")}, axis), pronasale[axis], 0.1);
  }
  want(length_measure("alar width", index("alare left"), index("alare right")),
       (at(bone, "alare left") - at(bone, "alare right")).norm() + 10.0 + features.alar_width_mm,
       0.1);
  const double intercanine =
      (at(bone, "supra-canine left") - at(bone, "supra-canine right")).norm();
  want(length_measure("mouth width", index("cheilion left"), index("cheilion right")),
       intercanine / 0.758 + features.mouth_width_mm, 0.1);
  const double ear_length = (person.sex == Sex::male ? 62.0 : 58.0) +
                            0.22 * (person.age_years - 45.0) + features.ear_length_mm;
  for (const char* side : {" left", " right"}) {
    const int top = index(std::string("superaurale") + side);
    const int bottom = index(std::string("subaurale") + side);
    want(length_measure("ear length", top, bottom), ear_length, 0.1);
    const double outwards = points[top].x() < 0.0 ? -1.0 : 1.0;
    want(coordinate_measure("ear protrusion", {top}, 0),
         points[top].x() + outwards * features.ear_protrusion_mm, 0.3);
  }

  Random random(mix(person.seed, 7));
  VectorXd start(basis_.size());
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    start[i] = share * person.tissue_freedom * random.normal();
  }
  FaceWarp face;
  std::vector<ClosestPoint> closest(carried.skin.rows());
  std::vector<double> thickness(carried.skin.rows());
  for (int round = 0; round < kPressRounds; ++round) {
    face.person_from_carried =
        basis_.warp(condition_warp(basis_, points, targets, start).coefficients);
    parallel_for(static_cast<int>(carried.skin.rows()), threads, [&](int v) {
      const Vector3d skin = face.person_from_carried(carried.skin.row(v));
      closest[v] = carried.bone->closest(skin);
      // Behind the bone if it lies on the other side than the canonical skin does. Over hollows
      // the two directions say nothing, but there the bone is far.
      const Vector3d outwards = (carried.skin.row(v) - carried.beneath.row(v)).transpose();
      const bool behind =
          closest[v].distance_mm < kDeepest_mm && outwards.dot(skin - closest[v].point) < 0.0;
      thickness[v] = behind ? -closest[v].distance_mm : closest[v].distance_mm;
    });
    face.least_thickness_mm = *std::ranges::min_element(thickness);
    if (face.least_thickness_mm >= kLeastThickness_mm) break;
    // Where the skin comes too close, the worst places are kept off, some way apart, each in the
    // direction from the bone that was beneath it.
    std::vector<int> close;
    for (int v = 0; v < static_cast<int>(thickness.size()); ++v) {
      if (thickness[v] < 1.2 * kLeastThickness_mm) close.push_back(v);
    }
    std::ranges::stable_sort(close, {}, [&](int v) { return thickness[v]; });
    std::vector<int> pressed;
    for (const int v : close) {
      const auto near = [&](int other) {
        return (carried.skin.row(v) - carried.skin.row(other)).norm() < 12.0;
      };
      if (pressed.size() == 30 || std::ranges::any_of(pressed, near)) continue;
      pressed.push_back(v);
      const Vector3d skin = carried.skin.row(v);
      const Vector3d beneath = carried.beneath.row(v);
      const double reach = (face.person_from_carried(skin) - beneath).norm();
      points.push_back(skin);
      targets.push_back({reach_measure("kept off", static_cast<int>(points.size()) - 1, beneath),
                         reach + 1.5 * kLeastThickness_mm - thickness[v], 0.2});
    }
  }
  face.least_determinant = least_determinant(face.person_from_carried, head_box(), 12.0, threads);
  for (std::size_t i = 0; i < canonical_.size(); ++i) {
    face.landmarks.push_back({canonical_[i].name, face.person_from_carried(carried.landmarks[i])});
  }
  for (const TissueThickness& row : table) {
    std::vector<double> sides;
    for (const auto& [on_bone, on_skin] : pair_names(row)) {
      sides.push_back((at(face.landmarks, on_skin) - at(bone, on_bone)).norm());
    }
    face.thickness_mm.push_back({sides.front(), sides.back()});
  }
  return face;
}

FaceWarp FaceWarpModel::fit(const PersonParameters& person, const BoneWarp& bone_warp,
                            const TriangleMesh& bone, int threads) const {
  const TriangleBvh tree(bone);
  Carried carried;
  carried.bone = &tree;
  for (const Landmark& landmark : canonical_) {
    carried.landmarks.push_back(bone_warp.person_from_canonical(landmark.position_mm));
  }
  carried.skin.resize(skin_.vertices.rows(), 3);
  carried.beneath.resize(skin_.vertices.rows(), 3);
  parallel_for(static_cast<int>(skin_.vertices.rows()), threads, [&](int v) {
    carried.skin.row(v) =
        bone_warp.person_from_canonical(skin_.vertices.row(v).transpose()).transpose();
    carried.beneath.row(v) =
        bone_warp.person_from_canonical(beneath_.row(v).transpose()).transpose();
  });
  double share = 1.0;
  for (int shrinkings = 0;; ++shrinkings, share *= 0.8) {
    FaceWarp face = fit_once(person, bone_warp, carried, share, threads);
    face.shrinkings = shrinkings;
    const bool sound = face.least_determinant > kLeastDeterminant &&
                       face.least_thickness_mm >= 0.5 * kLeastThickness_mm;
    if (sound || shrinkings == kMostShrinkings) return face;
  }
}

}  // namespace skullstation
