#include "reconstruction/approximation/face_estimate.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/parallel.h"
#include "reconstruction/approximation/head_residual.h"
#include "reconstruction/approximation/sphere_contacts.h"
#include "reconstruction/statistics/head_from_skull.h"

namespace skullstation {

namespace {

using Eigen::Index;

/// What the tissue model's modes leave over errs alike over a centimetre or two: all the face's
/// vertices together tell no more of it than so many on their own.
constexpr double independent_points = 300.0;
/// Foretold depths err alike over a centimetre or two: what one vertex's depth tells of its own.
constexpr double correlated_share = 0.1;
/// What the head model's modes leave over in people whom it has not seen.
constexpr double residual_sd_mm = 2.0;
constexpr double own_depth_sd_mm = 0.3;
constexpr double least_depth_sd_mm = 0.5;

bool rests_on_bone(HeadRegion region) {
  return region == HeadRegion::face || region == HeadRegion::scalp;
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
    const Eigen::VectorXd gain_of = state.both.covariance * row;
    const double variance =
        row.dot(gain_of) + log_sd * log_sd + tissue.noise_sd[v] * tissue.noise_sd[v];
    const double surprise =
        std::log(known.depth_mm) - tissue.log_mean[v] - row.dot(state.both.mean);
    state.both.mean += gain_of * (surprise / variance);
    state.both.covariance -= gain_of * gain_of.transpose() / variance;
  }
  return state;
}

/// Depths over the bone as the head's fit sees them.
struct Depths {
  Eigen::VectorXd mm;      ///< skull surface vertices; NaN: no sphere
  Eigen::VectorXd sd_mm;   ///< what the tissue's coefficients leave over
  Eigen::MatrixXd per_sd;  ///< vertices x #tissue modes: change for each standard deviation [mm]
};

/// Each vertex of the head over bone lies on the surface of the sphere that reaches nearest to it,
/// as far as its radius is known: head and radii are estimated together, so that an error which
/// all depths share is not mistaken for knowledge. Solved in rounds, since which sphere it is
/// depends on the head.
HeadAndTissue drawn_to_spheres(const FaceModel& model, const HeadAndTissue& prior,
                               const SphereContacts& contacts, const TriangleMesh& bone,
                               const Depths& depths, int rounds, int threads) {
  const Eigen::MatrixXd head_modes = model.head.scaled_modes();
  const Index tissue_modes = depths.per_sd.cols();
  const Index count = prior.both.mean.size();
  const auto head_vertices = static_cast<int>(model.head.vertex_count());
  const Eigen::MatrixXd prior_information = Eigen::LLT<Eigen::MatrixXd>(prior.both.covariance)
                                                .solve(Eigen::MatrixXd::Identity(count, count));

  HeadAndTissue state = prior;
  for (int round = 0; round < rounds; ++round) {
    const Points3 head = shape_at(model.head, state.both.mean.head(state.head_modes));
    const Points3 normals = vertex_normals({head, model.head_template.triangles, {}, {}});
    const Eigen::VectorXd radius_mm =
        depths.mm + depths.per_sd * state.both.mean.tail(tissue_modes);
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(head_vertices, count);
    Eigen::VectorXd values = Eigen::VectorXd::Zero(head_vertices);
    Eigen::VectorXd weights = Eigen::VectorXd::Zero(head_vertices);
    parallel_for(head_vertices, threads, [&](int v) {
      if (!rests_on_bone(model.head_template.region[static_cast<std::size_t>(v)])) return;
      const auto contact = contacts.of(head.row(v), normals.row(v), radius_mm);
      if (!contact) return;
      const Index nearest = contact->sphere;
      const Eigen::Vector3d& way = contact->way;
      const Eigen::Vector3d from = bone.vertices.row(nearest);
      // way . head(b) - radius(z) = way . bone, linear in both.
      rows.row(v).head(state.head_modes) = way.transpose() * head_modes.middleRows<3>(3 * Index{v});
      rows.row(v).tail(tissue_modes) = -depths.per_sd.row(nearest);
      values[v] =
          way.dot(from) + depths.mm[nearest] - way.dot(model.head.mean.segment<3>(3 * Index{v}));
      const double sd = std::max(depths.sd_mm[nearest], least_depth_sd_mm);
      weights[v] = 1.0 / (sd * sd + model.head.noise_variance);
    });
    const double seen = static_cast<double>((weights.array() > 0.0).count());
    weights *= std::min(1.0, independent_points / std::max(1.0, seen));
    const Eigen::MatrixXd weighted = rows.transpose() * weights.asDiagonal();
    const Eigen::LLT<Eigen::MatrixXd> factor(prior_information + weighted * rows);
    state.both.mean = factor.solve(prior_information * prior.both.mean + weighted * values);
    state.both.covariance = factor.solve(Eigen::MatrixXd::Identity(count, count));
  }
  return state;
}

/// The head moved on along its normals, from its model's modes towards the spheres. `own_share`:
/// what of a vertex's information is its own. In rounds, since which sphere it is depends on the
/// head.
Points3 bent_to_spheres(const FaceModel& model, const Points3& drawn,
                        const SphereContacts& contacts, const Eigen::VectorXd& radius_mm,
                        const Eigen::VectorXd& radius_sd_mm, double own_share, int rounds,
                        int threads) {
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
      const double sd = std::max(radius_sd_mm[contact->sphere], least_depth_sd_mm);
      wanted[static_cast<std::size_t>(v)] = {shift[v] - contact->gap_mm / cosine,
                                             own_share * cosine * cosine / (sd * sd)};
    });
    shift = residual_shift_mm(triangles, wanted, residual_sd_mm);
    head = drawn + shift.asDiagonal() * along;
  }
  return head;
}

/// How the head follows a variable of the joint model when what is known stays as it is.
FaceVariation variation_along(const FaceModel& model, const Belief& belief,
                              const std::string& name) {
  const int at = *model.joint.index_of(name);
  FaceVariation variation;
  variation.name = name;
  variation.sd_unit = std::sqrt(model.joint.covariance(at, at));
  Eigen::VectorXd step = Eigen::VectorXd::Zero(model.head.mode_count());
  const double variance = belief.covariance(at, at);
  const std::vector<std::string> names = coefficient_names("head", step.size());
  for (Index k = 0; k < step.size(); ++k) {
    const auto head = model.joint.index_of(names[static_cast<std::size_t>(k)]);
    if (head) step[k] = belief.covariance(*head, at) / variance * variation.sd_unit;
  }
  variation.per_sd_mm = shape_at(model.head, step) - unflattened(model.head.mean);
  return variation;
}

double factor_of(const std::vector<BandFactor>& bands, std::string_view region) {
  const auto found = std::ranges::find(bands, region, &BandFactor::region);
  if (found != bands.end()) return found->factor;
  // Without a calibration a Gaussian's own 80 %.
  return 1.2816;
}

}  // namespace

Result<void> FaceOptions::validate() const {
  if (const auto sound = facts.validate(); !sound) return sound;
  if (const auto sound = spheres.validate(); !sound) return sound;
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
  const Index tissue_modes = model.tissue.mode_count();
  HeadAndTissue prior{population_belief(model.head), model.head.mode_count()};
  Depths depths;
  switch (options.tissue) {
    case TissueChoice::conditional: {
      prior = updated(model.tissue, jointly(model, belief), options.known_depths);
      const Belief tissue = prior.tissue();
      face.tissue_mm = expected_tissue(model.tissue, tissue);
      face.tissue_sd_mm = tissue_sd_mm(model.tissue, tissue);
      // Linear round the expected depths: the logarithm's modes times the depth.
      depths.per_sd = face.tissue_mm.asDiagonal() * model.tissue.modes;
      depths.mm = face.tissue_mm - depths.per_sd * tissue.mean;
      depths.sd_mm = face.tissue_mm.cwiseProduct(model.tissue.noise_sd);
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
  if (options.tissue != TissueChoice::conditional) {
    // The paper's way: the spheres are taken as they are.
    depths = {face.tissue_mm, Eigen::VectorXd::Constant(surface_count, own_depth_sd_mm),
              Eigen::MatrixXd(surface_count, 0)};
  } else if (tissue_modes > 0) {
    for (Index v = 0; v < depths.per_sd.rows(); ++v) {
      if (std::isnan(depths.mm[v])) depths.per_sd.row(v).setZero();
    }
  }

  progress.report(0.2, "sphere model");
  const TriangleMesh bone = surface_of(model.skull_template, skull.vertices.topRows(surface_count));
  SphereModelOptions sphere_options = options.spheres;
  sphere_options.threads = options.threads;
  auto spheres = sphere_model(bone.vertices,
                              smoothed_depths(bone, face.tissue_mm, options.spheres.smoothing_mm),
                              sphere_options);
  if (!spheres) return forward(spheres);
  face.spheres = *std::move(spheres);
  if (progress.stop.stop_requested()) {
    return fail(ErrorKind::cancelled, "face", "stopped");
  }

  progress.report(0.5, "head");
  depths.mm = smoothed_depths(bone, depths.mm, options.spheres.smoothing_mm);
  const SphereContacts contacts(bone, depths.mm);
  const HeadAndTissue drawn =
      drawn_to_spheres(model, prior, contacts, bone, depths, options.rounds, options.threads);
  const Eigen::VectorXd radius_mm =
      depths.mm + depths.per_sd * drawn.both.mean.tail(depths.per_sd.cols());
  const bool known = options.tissue != TissueChoice::conditional;
  face.head = bent_to_spheres(model, shape_at(model.head, drawn.head().mean), contacts, radius_mm,
                              depths.sd_mm, known ? 1.0 : correlated_share, options.rounds,
                              options.threads);
  const Points3 normals = vertex_normals({face.head, model.head_template.triangles, {}, {}});
  // The bands were calibrated on what the joint model foretells from the skull; how much narrower
  // the spheres make them is not known from left-out subjects, so that it is not claimed.
  face.sd_mm = sd_along_normals_mm(model.head, prior.head().covariance, normals);
  face.band_mm.resize(face.sd_mm.size());
  for (Index v = 0; v < face.sd_mm.size(); ++v) {
    const HeadRegion region = model.head_template.region[static_cast<std::size_t>(v)];
    face.band_mm[v] = factor_of(model.bands, to_string(region)) * face.sd_mm[v];
    face.from_bone.push_back(rests_on_bone(region));
  }
  if (!model.joint.index_of("head 1")) {
    face.warnings.emplace_back(
        "The model's heads are of other people than its skulls: nose, lips, eyes and ears do not "
        "follow from the skull, only from the soft tissue around them.");
  }
  for (const std::string& name : coefficient_names("tissue", model.tissue.mode_count())) {
    if (model.joint.index_of(name)) {
      face.variations.push_back(variation_along(model, belief, name));
    }
  }
  if (model.joint.index_of("body mass index") && !options.facts.body_mass_index) {
    face.variations.push_back(variation_along(model, belief, "body mass index"));
  }
  return face;
}

}  // namespace skullstation
