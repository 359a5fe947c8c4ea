#include "reconstruction/statistics/population.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "reconstruction/registration/observed_bone.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/statistics/skull_completion.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr int alignment_rounds = 4;
constexpr std::size_t least_complete = 10;
constexpr double complete_share = 0.98;
constexpr double observation_sd_mm = 1.0;
constexpr std::size_t observation_count = 2000;
constexpr double independent_observations = 500.0;

void transform(Points3& points, const Similarity3& target_from_source) {
  for (Index v = 0; v < points.rows(); ++v) {
    const Eigen::Vector3d moved = target_from_source * Eigen::Vector3d(points.row(v));
    points.row(v) = moved;
  }
}

Result<void> check(const SkullTemplate& skull, const HeadTemplate& head,
                   const ModelSubject& subject) {
  const auto bad = [&](std::string what) {
    return fail(ErrorKind::bad_input, "subject " + subject.name, std::move(what),
                "fit it again with this template");
  };
  if (subject.skull.rows() != skull.vertices.rows() ||
      static_cast<int>(subject.skull_observed.size()) != skull.boundary_count ||
      subject.tissue_mm.size() != skull.boundary_count) {
    return bad(fmt::format("its skull has {} vertices, the template {}", subject.skull.rows(),
                           skull.vertices.rows()));
  }
  if (subject.head.rows() != head.vertices.rows()) {
    return bad(fmt::format("its head has {} vertices, the template {}", subject.head.rows(),
                           head.vertices.rows()));
  }
  if (!subject.skull.allFinite() || !subject.head.allFinite()) {
    return bad("a fitted vertex is not a number");
  }
  return {};
}

/// The depths of the subject's mirror image: NaN where a corner of the partner was not measured.
Eigen::VectorXd mirrored_depths(const SkullTemplate& skull, const Eigen::VectorXd& depths) {
  Eigen::VectorXd result(depths.size());
  for (Index v = 0; v < depths.size(); ++v) {
    const SurfacePoint& partner = skull.mirror[static_cast<std::size_t>(v)];
    double sum = 0.0;
    for (int k = 0; k < 3; ++k) {
      if (partner.weights[k] > 0.0) sum += partner.weights[k] * depths[partner.corners[k]];
    }
    result[v] = sum;
  }
  return result;
}

}  // namespace

Eigen::VectorXd skull_weights(const SkullTemplate& skull) {
  Eigen::VectorXd weights = Eigen::VectorXd::Zero(skull.vertices.rows());
  const Eigen::VectorXd areas =
      vertex_areas({skull.vertices.topRows(skull.boundary_count), skull.boundary, {}, {}});
  for (int v = 0; v < skull.boundary_count; ++v) {
    if (skull.outer[static_cast<std::size_t>(v)]) weights[v] = areas[v];
  }
  return weights;
}

Result<std::vector<ModelSubject>> aligned_population(const SkullTemplate& skull,
                                                     const HeadTemplate& head,
                                                     std::vector<ModelSubject> subjects) {
  for (const ModelSubject& subject : subjects) {
    if (const auto sound = check(skull, head, subject); !sound) return forward(sound);
  }
  if (subjects.empty()) return fail(ErrorKind::bad_input, "population", "has no subject");
  const Eigen::VectorXd weights = skull_weights(skull);
  Points3 reference = skull.vertices;
  for (int round = 0; round < alignment_rounds; ++round) {
    Points3 sum = Points3::Zero(reference.rows(), 3);
    for (ModelSubject& subject : subjects) {
      Eigen::VectorXd observed = weights;
      for (int v = 0; v < skull.boundary_count; ++v) {
        if (!subject.skull_observed[static_cast<std::size_t>(v)]) observed[v] = 0.0;
      }
      const auto pose = fit_similarity(subject.skull, reference, observed, FitScale::one);
      if (!pose) {
        Error error = pose.error();
        error.where = "subject " + subject.name;
        return tl::unexpected<Error>(std::move(error));
      }
      transform(subject.skull, *pose);
      transform(subject.head, *pose);
      sum += subject.skull;
    }
    // The mean goes back to where the template lies, or it would drift.
    reference = sum / static_cast<double>(subjects.size());
    const auto back = fit_similarity(reference, skull.vertices, weights, FitScale::one);
    if (!back) return forward(back);
    transform(reference, *back);
    for (ModelSubject& subject : subjects) {
      transform(subject.skull, *back);
      transform(subject.head, *back);
    }
  }
  return subjects;
}

Belief skull_belief(const SkullTemplate& skull, const ShapeModel& model, const Points3& vertices,
                    const std::vector<bool>& observed) {
  const std::vector<int> seen = observed_outer(skull, observed);
  const std::size_t step = std::max<std::size_t>(1, seen.size() / observation_count);
  const double used = std::ceil(static_cast<double>(seen.size()) / static_cast<double>(step));
  // Neighbours err alike: all together tell no more than so many on their own.
  const double sd_mm =
      observation_sd_mm * std::sqrt(std::max(1.0, used / independent_observations));
  std::vector<VertexObservation> observations;
  for (std::size_t i = 0; i < seen.size(); i += step) {
    observations.push_back({seen[i], vertices.row(seen[i]), Eigen::Vector3d::Zero(), sd_mm, sd_mm});
  }
  return updated(model, population_belief(model), observations);
}

void complete_skulls(const SkullTemplate& skull, std::vector<ModelSubject>& subjects) {
  std::vector<double> shares;
  shares.reserve(subjects.size());
  for (const ModelSubject& subject : subjects) {
    shares.push_back(observed_share(skull, subject.skull_observed));
  }
  if (shares.size() < least_complete) return;
  const double complete = complete_share * std::ranges::max(shares);
  std::vector<Points3> whole;
  std::vector<ModelSubject*> partial;
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    if (shares[i] >= complete) {
      whole.push_back(subjects[i].skull);
    } else {
      partial.push_back(&subjects[i]);
    }
  }
  if (whole.size() < least_complete || partial.empty()) return;
  const auto model = build_shape_model(whole, skull_weights(skull));
  if (!model) return;
  for (ModelSubject* subject : partial) {
    subject->skull =
        completed_skull(skull, *model, subject->skull, subject->skull_observed).vertices;
  }
}

Result<TissueModel> population_tissue_model(const SkullTemplate& skull,
                                            std::span<const ModelSubject> subjects,
                                            const TissueModelOptions& options) {
  Eigen::MatrixXd depths(skull.boundary_count, 2 * static_cast<Index>(subjects.size()));
  for (std::size_t n = 0; n < subjects.size(); ++n) {
    const auto column = 2 * static_cast<Index>(n);
    depths.col(column) = subjects[n].tissue_mm;
    depths.col(column + 1) = mirrored_depths(skull, subjects[n].tissue_mm);
  }
  auto model = build_tissue_model(depths, surface_of(skull, skull.vertices), options);
  // A subject and its mirror image are one subject.
  if (model) model->count = (model->count.array() + 1) / 2;
  return model;
}

}  // namespace skullstation
