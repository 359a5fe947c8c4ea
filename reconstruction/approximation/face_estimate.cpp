#include "reconstruction/approximation/face_estimate.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/parallel.h"
#include "reconstruction/approximation/expected_features.h"
#include "reconstruction/approximation/head_residual.h"
#include "reconstruction/approximation/sphere_contacts.h"
#include "reconstruction/registration/point_tree.h"
#include "reconstruction/statistics/head_from_skull.h"

namespace skullstation {

namespace {

using Eigen::Index;

/// Depths err alike over centimetres: all the face's vertices together tell of the head's modes no
/// more than so many on their own (docs/faces.md).
constexpr double independent_points = 30.0;
/// How closely the head keeps to the spheres.
constexpr double contact_sd_mm = 0.5;
/// What the head model's modes leave over in people whom it has not seen.
constexpr double residual_sd_mm = 2.0;
/// Of depths that were measured on the person.
constexpr double own_depth_sd_mm = 0.3;

/// Half width of the band that holds 80 % of a Gaussian, in standard deviations.
constexpr double gaussian_80 = 1.2816;

/// Half widths of the head's 80 % bands, calibrated where the model has calibrations. How much
/// narrower spheres and rules make them is not known from left-out subjects, so that it is not
/// claimed.
Eigen::VectorXd band_mm(const FaceModel& model, const Eigen::MatrixXd& covariance,
                        const Points3& head) {
  const Points3 normals = vertex_normals({head, model.head_template.triangles, {}, {}});
  Eigen::VectorXd band_mm = sd_along_normals_mm(model.head, covariance, normals);
  for (Index v = 0; v < band_mm.size(); ++v) {
    const HeadRegion region = model.head_template.region[static_cast<std::size_t>(v)];
    const auto band = std::ranges::find(model.bands, to_string(region), &BandFactor::region);
    band_mm[v] *= band == model.bands.end() ? gaussian_80 : band->factor;
  }
  return band_mm;
}

/// Head and tissue together: what is known of the head's coefficients, then the tissue's.
struct HeadAndTissue {
  Belief both;
  Index head_modes = 0;

  Belief head() const {
    return {both.mean.head(head_modes), both.covariance.topLeftCorner(head_modes, head_modes)};
  }
  Belief tissue() const {
    const Index modes = both.mean.size() - head_modes;
    return {both.mean.tail(modes), both.covariance.bottomRightCorner(modes, modes)};
  }
};

/// What the joint model foretells of both.
HeadAndTissue jointly(const FaceModel& model, const Belief& belief) {
  std::vector<std::string> names = coefficient_names("head", model.head.mode_count());
  std::ranges::copy(coefficient_names("tissue", model.tissue.mode_count()),
                    std::back_inserter(names));
  return {belief_about(model.joint, belief, names), model.head.mode_count()};
}

/// What is believed once depths are known. Logarithms of depths are linear in the tissue's
/// coefficients, so that this is a Gaussian's update; a depth where nothing is modelled tells
/// nothing.
HeadAndTissue updated(const TissueModel& tissue, HeadAndTissue state,
                      const std::vector<KnownDepth>& depths) {
  for (const KnownDepth& known : depths) {
    Index corner = 0;
    known.bone.weights.maxCoeff(&corner);
    const Index v = known.bone.corners[corner];
    if (!tissue.modelled[static_cast<std::size_t>(v)]) continue;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(state.both.mean.size());
    row.tail(tissue.mode_count()) = tissue.modes.row(v);
    const double log_sd = known.sd_mm / known.depth_mm;
    state.both.observe(row, std::log(known.depth_mm) - tissue.log_mean[v],
                       log_sd * log_sd + tissue.noise_sd[v] * tissue.noise_sd[v]);
  }
  return state;
}

/// What is believed of the head's modes once every vertex over bone is to lie on the surface of the
/// sphere that reaches nearest to it. Solved in rounds, since which sphere it is depends on the
/// head.
Belief drawn_to_spheres(const FaceModel& model, const Belief& prior, const SphereContacts& contacts,
                        const TriangleMesh& bone, const Eigen::VectorXd& radius_mm, int rounds,
                        int threads) {
  const Eigen::MatrixXd modes = model.head.scaled_modes();
  const Index count = prior.mean.size();
  const auto vertices = static_cast<int>(model.head.vertex_count());
  const Eigen::MatrixXd prior_information =
      Eigen::LLT<Eigen::MatrixXd>(prior.covariance).solve(Eigen::MatrixXd::Identity(count, count));
  const double contact_information =
      1.0 / (contact_sd_mm * contact_sd_mm + model.head.noise_variance);

  Belief belief = prior;
  for (int round = 0; round < rounds; ++round) {
    const Points3 head = shape_at(model.head, belief.mean);
    const Points3 normals = vertex_normals({head, model.head_template.triangles, {}, {}});
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(vertices, count);
    Eigen::VectorXd values = Eigen::VectorXd::Zero(vertices);
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(vertices);
    parallel_for(vertices, threads, [&](int v) {
      if (!rests_on_bone(model.head_template.region[static_cast<std::size_t>(v)])) return;
      const auto contact = contacts.of(head.row(v), normals.row(v), radius_mm);
      if (!contact) return;
      // way . head(b) = way . bone + radius, linear in b.
      const Eigen::Vector3d& way = contact->way;
      rows.row(v) = way.transpose() * modes.middleRows<3>(3 * Index{v});
      values[v] = way.dot(bone.vertices.row(contact->sphere)) + radius_mm[contact->sphere] -
                  way.dot(model.head.mean.segment<3>(3 * Index{v}));
      weights[v] = contact_information;
    });
    const double seen = static_cast<double>((weights.array() > 0.0).count());
    weights *= std::min(1.0, independent_points / std::max(1.0, seen));
    const Eigen::MatrixXd weighted = rows.transpose() * weights.asDiagonal();
    const Eigen::LLT<Eigen::MatrixXd> factor(prior_information + weighted * rows);
    belief.mean = factor.solve(prior_information * prior.mean + weighted * values);
    belief.covariance = factor.solve(Eigen::MatrixXd::Identity(count, count));
  }
  return belief;
}

/// The head moved on along its normals, from its model's modes towards the spheres. In rounds,
/// since which sphere it is depends on the head.
Points3 bent_to_spheres(const FaceModel& model, const Points3& drawn,
                        const SphereContacts& contacts, const Eigen::VectorXd& radius_mm,
                        int rounds, int threads) {
  const Triangles& triangles = model.head_template.triangles;
  const Points3 along = vertex_normals({drawn, triangles, {}, {}});
  Eigen::VectorXd shift = Eigen::VectorXd::Zero(drawn.rows());
  Points3 head = drawn;
  for (int round = 0; round < rounds; ++round) {
    const Points3 normals = vertex_normals({head, triangles, {}, {}});
    std::vector<WantedShift> wanted(static_cast<std::size_t>(head.rows()));
    parallel_for(static_cast<int>(head.rows()), threads, [&](int v) {
      if (!rests_on_bone(model.head_template.region[static_cast<std::size_t>(v)])) return;
      const auto contact = contacts.of(head.row(v), normals.row(v), radius_mm);
      if (!contact) return;
      const double cosine = contact->way.dot(along.row(v));
      if (cosine <= 0.0) return;
      wanted[static_cast<std::size_t>(v)] = {shift[v] - contact->gap_mm / cosine,
                                             cosine * cosine / (contact_sd_mm * contact_sd_mm)};
    });
    shift = residual_shift_mm(triangles, wanted, residual_sd_mm);
    head = drawn + shift.asDiagonal() * along;
  }
  return head;
}

/// How head and tissue follow a variable of the joint model when what is known stays as it is.
struct JointStep {
  double sd = 1.0;         ///< of the variable, in its own unit
  Eigen::VectorXd head;    ///< coefficients, for each standard deviation
  Eigen::VectorXd tissue;  ///< same
};

JointStep joint_step(const FaceModel& model, const Belief& belief, const std::string& name) {
  const int at = *model.joint.index_of(name);
  JointStep step;
  step.sd = std::sqrt(model.joint.covariance(at, at));
  const auto followed = [&](const std::string& what, Index count) {
    Eigen::VectorXd values = Eigen::VectorXd::Zero(count);
    const std::vector<std::string> names = coefficient_names(what, count);
    for (Index k = 0; k < count; ++k) {
      const auto of = model.joint.index_of(names[static_cast<std::size_t>(k)]);
      if (of) values[k] = belief.covariance(*of, at) / belief.covariance(at, at) * step.sd;
    }
    return values;
  };
  step.head = followed("head", model.head.mode_count());
  step.tissue = followed("tissue", model.tissue.mode_count());
  return step;
}

/// The head over a bone: as the spheres of these depths and what is foretold of its modes have it,
/// its nose and lids drawn to where rules expect them.
class HeadFit {
 public:
  /// \param features none: without rules
  HeadFit(const FaceModel& model, const TriangleMesh& bone, const FaceOptions& options,
          std::vector<ExpectedFeature> features)
      : model_(model), bone_(bone), options_(options), features_(std::move(features)) {}

  /// \param tissue_mm the bone's vertices, NaN where not modelled
  Points3 operator()(const Belief& prior, const Eigen::VectorXd& tissue_mm) const {
    const Eigen::VectorXd radius_mm =
        smoothed_depths(bone_, tissue_mm, options_.spheres.smoothing_mm);
    const SphereContacts contacts(bone_, radius_mm);
    const Belief drawn = drawn_to_spheres(model_, prior, contacts, bone_, radius_mm,
                                          options_.rounds, options_.threads);
    Points3 head = bent_to_spheres(model_, shape_at(model_.head, drawn.mean), contacts, radius_mm,
                                   options_.rounds, options_.threads);
    if (features_.empty()) return head;
    const Eigen::VectorXd sd_mm = band_mm(model_, prior.covariance, head) / gaussian_80;
    return drawn_to_features(model_.head_template, std::move(head), sd_mm, features_);
  }

 private:
  const FaceModel& model_;
  const TriangleMesh& bone_;
  const FaceOptions& options_;
  const std::vector<ExpectedFeature> features_;
};

/// The variation of a face along a variable: half way between the faces fitted anew at either end.
/// Depths vary in proportion, as in the paper's model, not by powers: a slider has to be linear.
FaceVariation variation_along(const FaceModel& model, const HeadFit& fit, const Belief& belief,
                              const Belief& prior, const FaceEstimate& face,
                              const std::string& name) {
  constexpr double reach_sd = FaceVariation::reach_sd;
  const JointStep step = joint_step(model, belief, name);
  const Eigen::ArrayXd growth = (model.tissue.modes * step.tissue).array();
  const auto refitted = [&](double sds) {
    Belief moved = prior;
    moved.mean += sds * step.head;
    const Eigen::ArrayXd depths = face.tissue_mm.array() * (1.0 + sds * growth);
    return fit(moved, face.tissue_mm.array().isNaN().select(face.tissue_mm,
                                                            depths.max(kThinnestTissue_mm)));
  };
  const Points3 above = refitted(reach_sd);
  const Points3 below = refitted(-reach_sd);
  FaceVariation variation;
  variation.name = name;
  variation.sd_unit = step.sd;
  variation.per_sd_mm = (above - below) / (2.0 * reach_sd);
  const Eigen::VectorXd gap_mm = (0.5 * (above + below) - face.head).rowwise().norm();
  variation.refit_gap_mm = gap_mm.mean();
  return variation;
}

/// Skin over bone that was not there is as uncertain as that bone, too.
void add_missing_bone(const CaseSkull& skull, const TriangleMesh& bone, FaceEstimate& face) {
  const PointTree nearest_bone(bone.vertices);
  for (Index v = 0; v < face.sd_mm.size(); ++v) {
    const auto below = nearest_bone.nearest(Eigen::Vector3d(face.head.row(v))).index;
    if (skull.observed[static_cast<std::size_t>(below)]) continue;
    face.sd_mm[v] = std::hypot(face.sd_mm[v], skull.sd_mm[below]);
    face.band_mm[v] = std::hypot(face.band_mm[v], gaussian_80 * skull.sd_mm[below]);
  }
}

}  // namespace

Result<void> FaceOptions::validate() const {
  if (const auto sound = facts.validate(); !sound) return forward(sound);
  if (const auto sound = spheres.validate(); !sound) return forward(sound);
  if (rounds < 1) return fail(ErrorKind::bad_input, "face, rounds", "must be at least 1");
  for (const KnownDepth& known : known_depths) {
    if (!(known.depth_mm > 0.0) || !(known.depth_mm < 80.0) || !(known.sd_mm > 0.0)) {
      return fail(
          ErrorKind::bad_input, "known depth",
          fmt::format("{} mm +- {} mm is no depth of soft tissue", known.depth_mm, known.sd_mm));
    }
  }
  return {};
}

Result<FaceEstimate> estimate_face(const FaceModel& model, const CaseSkull& skull,
                                   const FaceOptions& options, const Progress& progress) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  const int surface_count = model.skull_template.boundary_count;
  if (options.tissue == TissueChoice::measured && options.measured_mm.size() != surface_count) {
    return fail(ErrorKind::bad_input, "measured tissue",
                fmt::format("has {} depths, the skull {} surface vertices",
                            options.measured_mm.size(), surface_count));
  }
  FaceEstimate face;
  const Belief belief = foretold(model.joint, skull.belief, options.facts);

  progress.report(0.0, "tissue");
  Belief prior = population_belief(model.head);
  switch (options.tissue) {
    case TissueChoice::conditional: {
      const HeadAndTissue foreseen =
          updated(model.tissue, jointly(model, belief), options.known_depths);
      prior = foreseen.head();
      face.tissue_mm = expected_tissue(model.tissue, foreseen.tissue());
      face.tissue_sd_mm = tissue_sd_mm(model.tissue, foreseen.tissue());
      break;
    }
    case TissueChoice::population:
      face.tissue_mm = expected_tissue(model.tissue, population_tissue(model.tissue));
      face.tissue_sd_mm = tissue_sd_mm(model.tissue, population_tissue(model.tissue));
      break;
    case TissueChoice::measured:
      face.tissue_mm = options.measured_mm;
      face.tissue_sd_mm =
          options.measured_mm.array().isNaN().select(options.measured_mm, own_depth_sd_mm);
      break;
  }

  progress.report(0.2, "sphere model");
  const TriangleMesh bone = surface_of(model.skull_template, skull.vertices.topRows(surface_count));
  SphereModelOptions sphere_options = options.spheres;
  sphere_options.threads = options.threads;
  const Eigen::VectorXd radius_mm =
      smoothed_depths(bone, face.tissue_mm, options.spheres.smoothing_mm);
  auto spheres = sphere_model(bone.vertices, radius_mm, sphere_options);
  if (!spheres) return forward(spheres);
  face.spheres = *std::move(spheres);
  if (progress.stop.stop_requested()) {
    return fail(ErrorKind::cancelled, "face", "stopped");
  }

  progress.report(0.4, "head");
  const bool by_rules = options.feature_rules && options.tissue != TissueChoice::population;
  const std::vector<ExpectedFeature> features = expected_features(model.skull_template, skull);
  const HeadFit fit(model, bone, options, by_rules ? features : std::vector<ExpectedFeature>());
  face.head = fit(prior, face.tissue_mm);
  const Points3 normals = vertex_normals({face.head, model.head_template.triangles, {}, {}});
  face.sd_mm = sd_along_normals_mm(model.head, prior.covariance, normals);
  face.band_mm = band_mm(model, prior.covariance, face.head);
  add_missing_bone(skull, bone, face);
  for (const HeadRegion region : model.head_template.region) {
    face.from_bone.push_back(rests_on_bone(region));
  }
  for (const ExpectedFeature& feature : features) {
    face.features.push_back({feature.name, feature.source, feature.expected_mm, feature.sd_mm,
                             feature_mm(feature, model.head_template, face.head), by_rules});
  }
  if (const auto mouth = expected_mouth_width_mm(model.skull_template, skull)) {
    face.features.push_back({"width of the mouth", "Stephan & Henneberg 2003", *mouth, std::nullopt,
                             std::nullopt, false});
  }
  if (!model.joint.index_of("head 1")) {
    face.warnings.emplace_back(
        "The model's heads are of other people than its skulls: nose, lips, eyes and ears do not "
        "follow from the skull, only from the soft tissue around them.");
  }

  if (!options.variations) return face;
  std::vector<std::string> names = coefficient_names("tissue", model.tissue.mode_count());
  if (!options.facts.body_mass_index) names.emplace_back("body mass index");
  std::erase_if(names, [&](const std::string& name) { return !model.joint.index_of(name); });
  for (std::size_t i = 0; i < names.size(); ++i) {
    progress.report(0.5 + 0.5 * static_cast<double>(i) / static_cast<double>(names.size()),
                    "variants");
    if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "face", "stopped");
    face.variations.push_back(variation_along(model, fit, belief, prior, face, names[i]));
  }
  return face;
}

}  // namespace skullstation
