#include "reconstruction/statistics/leave_one_out.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

namespace skullstation {

namespace {

using Eigen::Index;

constexpr int least_subjects = 6;
/// Enough vertices to tell a skull's coefficients when models are built many times.
constexpr Index skull_sample = 4000;

/// Every so many outer vertices of the skull.
std::vector<Index> sampled_vertices(const Eigen::VectorXd& weights) {
  std::vector<Index> outer;
  for (Index v = 0; v < weights.size(); ++v) {
    if (weights[v] > 0.0) outer.push_back(v);
  }
  const std::size_t step = std::max<std::size_t>(1, outer.size() / skull_sample);
  std::vector<Index> sample;
  for (std::size_t i = 0; i < outer.size(); i += step) sample.push_back(outer[i]);
  return sample;
}

/// Signed distance of the predicted from the true vertices along the true normals.
Eigen::VectorXd along_normals(const Points3& predicted, const Points3& truth,
                              const Points3& normals) {
  return (predicted - truth).cwiseProduct(normals).rowwise().sum();
}

}  // namespace

Result<std::vector<LeftOut>> leave_one_out(const SkullTemplate& skull, const HeadTemplate& head,
                                           std::span<const ModelSubject> subjects,
                                           const TissueModel& tissue,
                                           const JointScoreOptions& options,
                                           const Progress& progress) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (subjects.size() < least_subjects) {
    return fail(
        ErrorKind::bad_input, "leave one out",
        fmt::format("{} subjects are too few, it takes {}", subjects.size(), least_subjects),
        "add subjects");
  }
  const Eigen::VectorXd all_weights = skull_weights(skull);
  const std::vector<Index> sample = sampled_vertices(all_weights);
  const Eigen::VectorXd weights = all_weights(sample);
  const Eigen::VectorXd head_areas = vertex_areas({head.vertices, head.triangles, {}, {}});
  std::vector<Points3> skulls;
  std::vector<Points3> heads;
  for (const ModelSubject& subject : subjects) {
    skulls.push_back(subject.skull(sample, Eigen::all));
    heads.push_back(subject.head);
  }

  std::vector<LeftOut> results;
  for (std::size_t n = 0; n < subjects.size(); ++n) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, "leave one out", "stopped");
    }
    progress.report(static_cast<double>(n) / static_cast<double>(subjects.size()),
                    "leaving one out");
    std::vector<ModelSubject> others(subjects.begin(), subjects.end());
    std::vector<Points3> other_skulls = skulls;
    std::vector<Points3> other_heads = heads;
    const auto at = static_cast<std::ptrdiff_t>(n);
    others.erase(others.begin() + at);
    other_skulls.erase(other_skulls.begin() + at);
    other_heads.erase(other_heads.begin() + at);
    const auto skull_model = build_shape_model(other_skulls, weights);
    if (!skull_model) return forward(skull_model);
    const auto head_model = build_shape_model(other_heads, head_areas);
    if (!head_model) return forward(head_model);
    const auto joint =
        joint_of(*skull_model, other_skulls, *head_model, other_heads, tissue, others, options);
    if (!joint) return forward(joint);

    const Points3 normals = vertex_normals({heads[n], head.triangles, {}, {}});
    const auto errors_of = [&](const Belief& of_head, const Belief& of_tissue) {
      return ForetoldErrors{
          along_normals(shape_at(*head_model, of_head.mean), heads[n], normals),
          sd_along_normals_mm(*head_model, of_head.covariance, normals),
          mean_depth_error_mm(tissue, expected_tissue(tissue, of_tissue), subjects[n].tissue_mm)};
    };
    const Eigen::VectorXd coefficients = coefficients_of(*skull_model, skulls[n]);
    const Belief skull_belief{coefficients,
                              Eigen::MatrixXd::Zero(coefficients.size(), coefficients.size())};
    const auto given = [&](const PersonFacts& facts) {
      const Belief all = foretold(*joint, skull_belief, facts);
      return errors_of(
          belief_about(*joint, all, coefficient_names("head", head_model->mode_count())),
          belief_about(*joint, all, coefficient_names("tissue", tissue.mode_count())));
    };
    LeftOut left;
    left.mean = errors_of(population_belief(*head_model), population_tissue(tissue));
    left.given_skull = given({});
    left.given_all = given(subjects[n].facts);
    results.push_back(std::move(left));
  }
  return results;
}

double mean_facial_error_mm(const HeadTemplate& head, const Eigen::VectorXd& errors_mm) {
  double sum = 0.0;
  double count = 0.0;
  for (Index v = 0; v < errors_mm.size(); ++v) {
    if (!is_facial(head.region[static_cast<std::size_t>(v)])) continue;
    sum += std::abs(errors_mm[v]);
    ++count;
  }
  return sum / std::max(1.0, count);
}

std::vector<BandFactor> calibrated_bands(const HeadTemplate& head,
                                         std::span<const LeftOut> left_out, double level) {
  std::vector<BandFactor> bands;
  const auto add = [&](std::string region, const auto& belongs) {
    std::vector<double> ratios;
    for (const LeftOut& subject : left_out) {
      for (std::size_t v = 0; v < head.region.size(); ++v) {
        if (!belongs(head.region[v])) continue;
        const auto at = static_cast<Index>(v);
        ratios.push_back(std::abs(subject.given_skull.head_mm[at]) /
                         subject.given_skull.head_sd_mm[at]);
      }
    }
    if (const auto factor = conformal_factor(ratios, level)) {
      bands.push_back({std::move(region), level, *factor, static_cast<int>(ratios.size())});
    }
  };
  add("all", [](HeadRegion) { return true; });
  for (int r = 0; r < kHeadRegionCount; ++r) {
    const auto region = static_cast<HeadRegion>(r);
    add(std::string(to_string(region)), [&](HeadRegion of) { return of == region; });
  }
  return bands;
}

}  // namespace skullstation
