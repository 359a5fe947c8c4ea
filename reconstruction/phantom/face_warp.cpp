#include "reconstruction/phantom/face_warp.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/anatomy/feature_rules.h"

namespace skullstation {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr double kLeastDeterminant = 0.15;
constexpr double kLeastThickness_mm = 1.5;
/// What is aimed at where the skin came too close, and what will do: more than the least, since
/// not every point of the skin is watched.
constexpr double kSafeThickness_mm = 2.3;
constexpr double kSettledThickness_mm = 1.9;
/// Below it the tissue at a landmark, and between landmarks, yields ever less to thinner draws.
constexpr double kThinLandmark_mm = 1.75;
constexpr double kThinTissue_mm = 2.3;
/// Skin farther from the bone than this is not watched.
constexpr double kWatched_mm = 30.0;
/// Lids, nose and mouth.
const Eigen::AlignedBox3d kFeatures{Vector3d(-60.0, -130.0, -60.0), Vector3d(60.0, -60.0, 40.0)};
/// Where the skin comes too close, what lies within this distance is pushed away.
constexpr double kPushRadius_mm = 11.0;
constexpr double kMostPushed_mm = 3.0;
constexpr double kScalpSpacing_mm = 28.0;
constexpr int kRounds = 10;
constexpr int kCorrections = 2;
constexpr int kMostShrinkings = 10;

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
      {.spacing_mm = 14.0,
       .width_mm = 14.0,
       .sd_mm = 0.8,
       .covers =
           [](const Vector3d& center) {
             return center.y() < -60.0 && center.x() < 45.0 && center.z() < 50.0;
           }},
      {.spacing_mm = 10.0, .width_mm = 9.0, .sd_mm = 0.5, .covers = [](const Vector3d& center) {
         return center.y() < -75.0 && center.x() < 35.0 && center.z() > -75.0 && center.z() < 35.0;
       }}};
  return options;
}

/// The value, bent off smoothly so that it stays above `least`.
double soft_floor(double value, double least) {
  const double bend = 0.15 * least;
  const double above = (value - least) / bend;
  return above > 30.0 ? value : least + bend * std::log1p(std::exp(above));
}

Vector3d at(const std::vector<Landmark>& landmarks, std::string_view name) {
  return landmarks[landmark_index(landmarks, name)].position_mm;
}

Vector3d pronasale_over(const std::vector<Landmark>& bone, const FeatureResiduals& residuals) {
  const NoseBones bones{at(bone, "nasion"),      at(bone, "acanthion"), at(bone, "rhinion"),
                        at(bone, "subspinale"),  at(bone, "prosthion"), at(bone, "porion left"),
                        at(bone, "porion right")};
  return expected_pronasale(bones, residuals.pronasale_forward_mm, residuals.pronasale_down_mm);
}

}  // namespace

FaceWarpModel::FaceWarpModel(const SkullMeshes& skull, std::vector<Landmark> bone_landmarks,
                             TriangleMesh skin, std::vector<Landmark> skin_landmarks)
    : bone_(skull),
      bone_landmarks_(std::move(bone_landmarks)),
      skin_(std::move(skin)),
      skin_surface_(skin_),
      skin_landmarks_(std::move(skin_landmarks)),
      basis_(head_box(), face_basis()) {
  const Vector3d left_ear =
      0.5 * (at(skin_landmarks_, "superaurale left") + at(skin_landmarks_, "subaurale left"));
  sites_ = tissue_sites(skin_, bone_, left_ear);
  site_rows_.resize(static_cast<Eigen::Index>(sites_.size()), basis_.size());
  for (std::size_t s = 0; s < sites_.size(); ++s) {
    const Vector3d outwards = (sites_[s].skin - sites_[s].bone).normalized();
    site_rows_.row(static_cast<Eigen::Index>(s)) =
        outwards.transpose() * basis_.displacements(sites_[s].skin);
  }
  site_gram_ = site_rows_ * site_rows_.transpose();
  for (int v = 0; v < static_cast<int>(skin_.vertices.rows()); ++v) {
    const Vector3d place = skin_.vertices.row(v);
    // Every vertex where the skin has folds, such as between the lips, else one in four.
    if (v % 4 != 0 && !kFeatures.contains(place)) continue;
    if (!std::isfinite(bone_.nearest(place, {}, kWatched_mm).distance_mm)) continue;
    watched_.push_back(v);
    std::vector<int>& near = sites_near_.emplace_back();
    for (std::size_t s = 0; s < sites_.size(); ++s) {
      if ((sites_[s].skin - place).norm() < kPushRadius_mm) near.push_back(static_cast<int>(s));
    }
  }
}

/// The search for one person's face: a linear problem for the coefficients of the warp, whose
/// wanted displacements are corrected a few times for what the bone's warp makes of them.
class FaceWarpModel::Fit {
 public:
  Fit(const FaceWarpModel& model, const PersonParameters& person, const BoneWarp& bone,
      int threads);

  /// `share` 1: the drawn face; 0: the canonical one.
  FaceWarp solve(double share);

 private:
  /// A landmark of the bone and its partner on the skin.
  struct Pair {
    int landmark = 0;   ///< index of the skin's
    Vector3d skin;      ///< canonical
    Vector3d bone;      ///< the person's
    Vector3d outwards;  ///< from there to the skin of the canonical face, of unit length
    double canonical_mm = 0.0;
    double carried_mm = 0.0;  ///< thickness of the canonical face over the person's bone
    double wanted_mm = 0.0;
    Vector3d moved;  ///< displacement of the skin with the mandible: outwards and two across
    double pushed_mm = 0.0;  ///< added to the thickness, since the skin beside it came too close

    double goal_mm(double share) const {
      return carried_mm * std::pow(wanted_mm / carried_mm, share) + pushed_mm;
    }
  };
  /// Two landmarks of the skin and how far apart they shall be.
  struct Length {
    int from = 0;
    int to = 0;
    double carried_mm = 0.0;
    double wanted_mm = 0.0;
  };
  /// A sum of displacements of canonical skin points along directions, and what it shall be.
  struct Target {
    Eigen::RowVectorXd row;
    double tolerance_mm = 0.1;
    double value_mm = 0.0;
  };

  void add_pairs();
  void add_features();
  void add_length(const std::string& from, const std::string& to, double wanted_mm);
  void add_ear(const char* side);
  Eigen::RowVectorXd row(const Vector3d& point, const Vector3d& towards) const {
    return towards.transpose() * model_.basis_.displacements(point);
  }
  void find_log_ratios();
  void factorize();
  void reset(double share);
  /// Corrects the targets by what the warp misses.
  void correct(const SpaceWarp& warp, double share);
  /// Pushes the sites near places where the skin comes too close; gives the least thickness [mm].
  double push(const SpaceWarp& warp);
  VectorXd wanted(double share) const;
  FaceWarp face(const SpaceWarp& warp) const;

  Vector3d skin_landmark(int index) const { return model_.skin_landmarks_[index].position_mm; }
  Vector3d carried(const Vector3d& canonical) const {
    return bone_.person_from_canonical(canonical);
  }

  const FaceWarpModel& model_;
  const PersonParameters& person_;
  const BoneWarp& bone_;
  int threads_;
  std::vector<Pair> pairs_;
  std::vector<Length> lengths_;
  int pronasale_ = 0;
  Vector3d pronasale_wanted_;                 ///< in the person
  Eigen::Matrix3d canonical_from_pronasale_;  ///< what moves the carried tip by unit steps
  /// Three of every pair, one of every length, two of the tip of the nose, two of the ears.
  std::vector<Target> targets_;
  VectorXd site_carried_mm_;  ///< thickness of the canonical face over the person's bone
  VectorXd site_moved_mm_;    ///< by which the mandible moves the site away from its bone's place
  VectorXd log_ratios_;       ///< of wanted to carried thickness at the sites
  VectorXd pushed_mm_;        ///< what is added to the sites' thickness
  MatrixXd rows_;             ///< of the targets
  Eigen::LLT<MatrixXd> gram_;
};

FaceWarpModel::Fit::Fit(const FaceWarpModel& model, const PersonParameters& person,
                        const BoneWarp& bone, int threads)
    : model_(model), person_(person), bone_(bone), threads_(threads) {
  const auto sites = static_cast<Eigen::Index>(model_.sites_.size());
  site_carried_mm_.resize(sites);
  site_moved_mm_.resize(sites);
  for (Eigen::Index s = 0; s < sites; ++s) {
    const TissueSite& site = model_.sites_[s];
    const Rigid3 turn = site.on_mandible ? bone_.open_from_closed : Rigid3{};
    site_carried_mm_[s] = (carried(turn * site.skin) - carried(turn * site.bone)).norm();
    site_moved_mm_[s] = (turn * site.skin - site.skin).dot((site.skin - site.bone).normalized());
  }
  add_pairs();
  add_features();
  find_log_ratios();
  factorize();
}

void FaceWarpModel::Fit::add_pairs() {
  const auto table = thickness_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    for (const char* side : {" left", " right"}) {
      const std::string suffix = table[i].bilateral ? side : "";
      const std::string name(table[i].bone);
      const int on_bone = landmark_index(bone_.landmarks, name + suffix);
      const Rigid3 turn = bone_.landmarks[on_bone].on_mandible ? bone_.open_from_closed : Rigid3{};
      const Vector3d bone = turn.inverse() * bone_.canonical_mm[on_bone];
      Pair pair;
      pair.landmark =
          landmark_index(model_.skin_landmarks_, fmt::format("{} skin{}", name, suffix));
      pair.skin = skin_landmark(pair.landmark);
      // Bone landmarks that are extremes lie elsewhere on each skull, and the skin's go with them.
      const Vector3d shift = bone - model_.bone_landmarks_[on_bone].position_mm;
      if (shift.norm() > 1e-6) pair.skin = model_.skin_surface_.closest(pair.skin + shift).point;
      pair.bone = bone_.landmarks[on_bone].position_mm;
      pair.canonical_mm = (pair.skin - bone).norm();
      const Vector3d thickness = carried(turn * pair.skin) - pair.bone;
      pair.carried_mm = thickness.norm();
      pair.outwards = thickness.normalized();
      const ThicknessPair& drawn = person_.thickness_mm[i];
      // Where the landmarks face each other aslant the bone is nearer than they are.
      const double aslant = pair.canonical_mm / model_.bone_.nearest(pair.skin).distance_mm;
      pair.wanted_mm = soft_floor(side[1] == 'l' ? drawn.left_mm : drawn.right_mm,
                                  std::min(aslant, 1.4) * kThinLandmark_mm);
      const Vector3d outwards = (pair.skin - bone).normalized();
      const Vector3d across = outwards.unitOrthogonal();
      const Vector3d along = outwards.cross(across);
      const Vector3d moved = turn * pair.skin - pair.skin;
      pair.moved = {outwards.dot(moved), across.dot(moved), along.dot(moved)};
      // Thin tissue moved along the bone would change its thickness by that alone.
      const double slide_mm = pair.canonical_mm < 8.0 ? 0.5 : 1.5;
      targets_.push_back({row(pair.skin, outwards), 0.1, 0.0});
      targets_.push_back({row(pair.skin, across), slide_mm, 0.0});
      targets_.push_back({row(pair.skin, along), slide_mm, 0.0});
      pairs_.push_back(std::move(pair));
      if (!table[i].bilateral) break;
    }
  }
}

void FaceWarpModel::Fit::add_length(const std::string& from, const std::string& to,
                                    double wanted_mm) {
  Length length;
  length.from = landmark_index(model_.skin_landmarks_, from);
  length.to = landmark_index(model_.skin_landmarks_, to);
  const Vector3d start = skin_landmark(length.from);
  const Vector3d end = skin_landmark(length.to);
  length.carried_mm = (carried(end) - carried(start)).norm();
  length.wanted_mm = wanted_mm;
  const Vector3d along = (end - start).normalized();
  targets_.push_back({row(end, along) - row(start, along), 0.4, 0.0});
  lengths_.push_back(length);
}

void FaceWarpModel::Fit::add_features() {
  const auto& bone = bone_.landmarks;
  const auto between = [&](const char* a, const char* b) {
    return (at(bone, a) - at(bone, b)).norm();
  };
  const FeatureResiduals& residuals = person_.features;
  add_length("alare right", "alare left",
             between("alare left", "alare right") + kAlarWings_mm + residuals.alar_width_mm);
  add_length("cheilion right", "cheilion left",
             between("supra-canine left", "supra-canine right") / kCaninesToMouth +
                 residuals.mouth_width_mm);
  const double ear_mm = (person_.sex == Sex::male ? 62.0 : 58.0) +
                        0.22 * (person_.age_years - 45.0) + residuals.ear_length_mm;
  add_length("subaurale left", "superaurale left", ear_mm);
  add_length("subaurale right", "superaurale right", ear_mm);

  pronasale_ = landmark_index(model_.skin_landmarks_, "pronasale");
  const Vector3d tip = skin_landmark(pronasale_);
  pronasale_wanted_ = pronasale_over(bone, residuals);
  canonical_from_pronasale_ = bone_.person_from_canonical.jacobian(tip).inverse();
  targets_.push_back({row(tip, Vector3d::UnitY()), 0.3, 0.0});
  targets_.push_back({row(tip, Vector3d::UnitZ()), 0.3, 0.0});
  for (const char* name : {"superaurale left", "superaurale right"}) {
    const Vector3d top = at(model_.skin_landmarks_, name);
    const Vector3d outwards(top.x() < 0.0 ? -1.0 : 1.0, 0.0, 0.0);
    targets_.push_back({row(top, outwards), 0.3, 0.0});
  }
}

void FaceWarpModel::Fit::find_log_ratios() {
  std::vector<Vector3d> known;
  std::vector<double> log_ratios;
  const auto know = [&](const Vector3d& place, double wanted_mm, double carried_mm) {
    known.push_back(place);
    log_ratios.push_back(std::log(wanted_mm / carried_mm));
  };
  for (const Pair& pair : pairs_) know(pair.skin, pair.wanted_mm, pair.carried_mm);
  // The scalp is about as thick everywhere as at the vertex and the opisthocranion.
  const auto wanted_at = [&](const char* name) {
    const int landmark = landmark_index(model_.skin_landmarks_, name);
    return std::ranges::find(pairs_, landmark, &Pair::landmark)->wanted_mm;
  };
  const double scalp_mm = std::sqrt(wanted_at("vertex skin") * wanted_at("opisthocranion skin"));
  std::vector<Vector3d> places;
  for (std::size_t s = 0; s < model_.sites_.size(); ++s) {
    const TissueSite& site = model_.sites_[s];
    places.push_back(site.skin);
    const auto near = [&](const Vector3d& other) {
      return (site.skin - other).norm() < kScalpSpacing_mm;
    };
    if (!site.on_vault || std::ranges::any_of(known, near)) continue;
    know(site.skin, scalp_mm, site_carried_mm_[static_cast<Eigen::Index>(s)]);
  }
  log_ratios_ =
      log_ratio_kriging(known, places) *
      Eigen::Map<const VectorXd>(log_ratios.data(), static_cast<Eigen::Index>(log_ratios.size()));
}

void FaceWarpModel::Fit::factorize() {
  const Eigen::Index sites = model_.site_rows_.rows();
  const auto targets = static_cast<Eigen::Index>(targets_.size());
  rows_.resize(targets, model_.basis_.size());
  for (Eigen::Index t = 0; t < targets; ++t) rows_.row(t) = targets_[t].row;
  MatrixXd gram(sites + targets, sites + targets);
  gram.topLeftCorner(sites, sites) = model_.site_gram_;
  gram.bottomLeftCorner(targets, sites) = rows_ * model_.site_rows_.transpose();
  gram.bottomRightCorner(targets, targets) = rows_ * rows_.transpose();
  for (Eigen::Index s = 0; s < sites; ++s) {
    // Deep tissue is steered less strictly: the bone nearest to it says less.
    const double tolerance_mm = 0.1 + 0.05 * model_.sites_[s].depth_mm;
    gram(s, s) += tolerance_mm * tolerance_mm;
  }
  for (Eigen::Index t = 0; t < targets; ++t) {
    gram(sites + t, sites + t) += targets_[t].tolerance_mm * targets_[t].tolerance_mm;
  }
  gram_.compute(gram);  // reads the lower triangle alone
}

void FaceWarpModel::Fit::reset(double share) {
  pushed_mm_ = VectorXd::Zero(site_carried_mm_.size());
  std::size_t t = 0;
  for (Pair& pair : pairs_) {
    pair.pushed_mm = 0.0;
    const double ratio = pair.goal_mm(share) / pair.carried_mm;
    targets_[t++].value_mm = pair.moved[0] + (ratio - 1.0) * pair.canonical_mm;
    targets_[t++].value_mm = pair.moved[1];
    targets_[t++].value_mm = pair.moved[2];
  }
  for (const Length& length : lengths_) {
    targets_[t++].value_mm = share * (length.wanted_mm - length.carried_mm);
  }
  const Vector3d step = canonical_from_pronasale_ *
                        (share * (pronasale_wanted_ - carried(skin_landmark(pronasale_))));
  targets_[t++].value_mm = step.y();
  targets_[t++].value_mm = step.z();
  targets_[t++].value_mm = share * person_.features.ear_protrusion_mm;
  targets_[t++].value_mm = share * person_.features.ear_protrusion_mm;
}

void FaceWarpModel::Fit::correct(const SpaceWarp& warp, double share) {
  std::size_t t = 0;
  for (const Pair& pair : pairs_) {
    const double miss_mm =
        pair.goal_mm(share) - (carried(warp(pair.skin)) - pair.bone).dot(pair.outwards);
    targets_[t].value_mm += miss_mm * pair.canonical_mm / pair.carried_mm;
    t += 3;
  }
  for (const Length& length : lengths_) {
    const double goal_mm = length.carried_mm + share * (length.wanted_mm - length.carried_mm);
    const Vector3d from = carried(warp(skin_landmark(length.from)));
    const Vector3d to = carried(warp(skin_landmark(length.to)));
    targets_[t++].value_mm += goal_mm - (to - from).norm();
  }
  const Vector3d tip = carried(skin_landmark(pronasale_));
  const Vector3d goal = tip + share * (pronasale_wanted_ - tip);
  const Vector3d step =
      canonical_from_pronasale_ * (goal - carried(warp(skin_landmark(pronasale_))));
  targets_[t++].value_mm += step.y();
  targets_[t++].value_mm += step.z();
}

double FaceWarpModel::Fit::push(const SpaceWarp& warp) {
  const auto count = static_cast<int>(model_.watched_.size());
  std::vector<double> thickness_mm(count);
  parallel_for(count, threads_, [&](int w) {
    const Vector3d start = model_.skin_.vertices.row(model_.watched_[w]);
    const Vector3d end = warp(start);
    const Clearance clear = clearance(model_.bone_, bone_.open_from_closed, start, end);
    thickness_mm[w] =
        clear.distance_mm < 0.0 ? clear.distance_mm : (carried(end) - carried(clear.bone)).norm();
  });
  VectorXd missing_mm = VectorXd::Zero(pushed_mm_.size());
  std::vector<double> pair_missing_mm(pairs_.size(), 0.0);
  for (int w = 0; w < count; ++w) {
    const double missing = kSafeThickness_mm - thickness_mm[w];
    if (missing <= 0.0) continue;
    for (const int site : model_.sites_near_[w]) {
      missing_mm[site] = std::max(missing_mm[site], missing);
    }
    const Vector3d place = model_.skin_.vertices.row(model_.watched_[w]);
    for (std::size_t p = 0; p < pairs_.size(); ++p) {
      if ((pairs_[p].skin - place).norm() > kPushRadius_mm) continue;
      pair_missing_mm[p] = std::max(pair_missing_mm[p], missing);
    }
  }
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    pairs_[p].pushed_mm = std::min(pairs_[p].pushed_mm + pair_missing_mm[p], kMostPushed_mm);
  }
  pushed_mm_ = (pushed_mm_ + missing_mm).cwiseMin(kMostPushed_mm);
  return *std::ranges::min_element(thickness_mm);
}

VectorXd FaceWarpModel::Fit::wanted(double share) const {
  const Eigen::Index sites = site_carried_mm_.size();
  VectorXd wanted(sites + rows_.rows());
  for (Eigen::Index s = 0; s < sites; ++s) {
    const double thickness_mm =
        soft_floor(site_carried_mm_[s] * std::exp(share * log_ratios_[s]), kThinTissue_mm) +
        pushed_mm_[s];
    wanted[s] = site_moved_mm_[s] + (thickness_mm / site_carried_mm_[s] - 1.0) *
                                        model_.sites_[static_cast<std::size_t>(s)].depth_mm;
  }
  for (std::size_t t = 0; t < targets_.size(); ++t) {
    wanted[sites + static_cast<Eigen::Index>(t)] = targets_[t].value_mm;
  }
  return wanted;
}

FaceWarp FaceWarpModel::Fit::face(const SpaceWarp& warp) const {
  FaceWarp face;
  face.face_from_canonical = warp;
  face.landmarks = model_.skin_landmarks_;
  for (const Pair& pair : pairs_) face.landmarks[pair.landmark].position_mm = pair.skin;
  for (Landmark& landmark : face.landmarks) {
    landmark.position_mm = carried(warp(landmark.position_mm));
  }
  std::size_t p = 0;
  for (const TissueThickness& row : thickness_table()) {
    const auto next_mm = [&] {
      const Pair& pair = pairs_[p++];
      return (face.landmarks[pair.landmark].position_mm - pair.bone).norm();
    };
    const double left_mm = next_mm();
    face.thickness_mm.push_back({left_mm, row.bilateral ? next_mm() : left_mm});
  }
  face.least_determinant = least_determinant(warp, head_box(), 12.0, threads_);
  return face;
}

FaceWarp FaceWarpModel::Fit::solve(double share) {
  Random random(mix(person_.seed, 7));
  VectorXd start(model_.basis_.size());
  for (Eigen::Index i = 0; i < start.size(); ++i) {
    start[i] = share * person_.tissue_freedom * random.normal();
  }
  const Eigen::Index sites = model_.site_rows_.rows();
  VectorXd own(sites + rows_.rows());
  own << model_.site_rows_ * start, rows_ * start;
  reset(share);
  SpaceWarp best;
  double best_thickness_mm = -std::numeric_limits<double>::infinity();
  for (int round = 0; round < kRounds; ++round) {
    const VectorXd weights = gram_.solve(wanted(share) - own);
    SpaceWarp warp =
        model_.basis_.warp(start + model_.site_rows_.transpose() * weights.head(sites) +
                           rows_.transpose() * weights.tail(rows_.rows()));
    if (round < kCorrections) correct(warp, share);
    const double least_mm = push(warp);
    const bool enough = least_mm > kSettledThickness_mm;
    if (least_mm > best_thickness_mm || enough) {
      best = std::move(warp);
      best_thickness_mm = least_mm;
    }
    if (enough && round >= kCorrections) break;
  }
  FaceWarp result = face(best);
  result.least_thickness_mm = best_thickness_mm;
  return result;
}

FaceWarp FaceWarpModel::fit(const PersonParameters& person, const BoneWarp& bone,
                            int threads) const {
  Fit fit(*this, person, bone, threads);
  double share = 1.0;
  for (int shrinkings = 0;; ++shrinkings) {
    FaceWarp face = fit.solve(share);
    face.shrinkings = shrinkings;
    const bool sound =
        face.least_determinant > kLeastDeterminant && face.least_thickness_mm >= kLeastThickness_mm;
    if (sound || shrinkings == kMostShrinkings) return face;
    share = shrinkings + 1 == kMostShrinkings ? 0.0 : 0.8 * share;
  }
}

}  // namespace skullstation
