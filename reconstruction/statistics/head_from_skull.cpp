#include "reconstruction/statistics/head_from_skull.h"

#include <algorithm>
#include <limits>

namespace skullstation {

namespace {

using Eigen::Index;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();

/// A covariate takes part if most subjects have it and it varies.
bool tells(std::span<const ModelSubject> subjects, std::optional<double> PersonFacts::*covariate) {
  std::vector<double> known;
  for (const ModelSubject& subject : subjects) {
    if (const auto& value = subject.facts.*covariate) known.push_back(*value);
  }
  return 2 * known.size() > subjects.size() && std::ranges::max(known) > std::ranges::min(known);
}

}  // namespace

Result<void> JointScoreOptions::validate() const {
  if (skull_modes < 1 || head_modes < 1) {
    return fail(ErrorKind::bad_input, "joint model", "needs at least one mode of each");
  }
  return {};
}

Result<JointModel> joint_of(const ShapeModel& skull_model, std::span<const Points3> skulls,
                            const ShapeModel& head_model, std::span<const Points3> heads,
                            const TissueModel& tissue, std::span<const ModelSubject> subjects,
                            const JointScoreOptions& options) {
  const Index skull_modes = std::min<Index>(options.skull_modes, skull_model.mode_count());
  const Index head_modes = std::min<Index>(options.head_modes, head_model.mode_count());
  std::vector<VariableBlock> blocks = {{"skull", coefficient_names("skull", skull_modes), {}, {}}};
  std::vector<Covariate> known;
  for (const Covariate& covariate : covariates()) {
    if (!tells(subjects, covariate.value)) continue;
    known.push_back(covariate);
    blocks.push_back({covariate.name, {covariate.name}, {}, {}});
  }
  // An error of a coefficient weighs what it moves. Depths are not read from the skull: what a
  // population seems to tell there (depths 3 % nearer, left one out) is how its bone surfaces err,
  // and makes faces over other surfaces 5 % worse (docs/faces.md).
  blocks.push_back({"tissue",
                    coefficient_names("tissue", tissue.mode_count()),
                    tissue.modes.colwise().norm().transpose(),
                    {"skull"}});
  blocks.push_back({"head",
                    coefficient_names("head", head_modes),
                    head_model.variances.head(head_modes).cwiseSqrt(),
                    {}});
  const auto covariate_count = static_cast<Index>(known.size());
  Eigen::MatrixXd values(skull_modes + covariate_count + tissue.mode_count() + head_modes,
                         static_cast<Index>(subjects.size()));
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    Eigen::VectorXd covariate_values(covariate_count);
    for (std::size_t c = 0; c < known.size(); ++c) {
      covariate_values[static_cast<Index>(c)] =
          (subjects[i].facts.*known[c].value).value_or(not_a_number);
    }
    values.col(static_cast<Index>(i)) << coefficients_of(skull_model, skulls[i]).head(skull_modes),
        covariate_values, tissue_belief(tissue, subjects[i].tissue_mm).mean,
        coefficients_of(head_model, heads[i]).head(head_modes);
  }
  return build_joint_model(blocks, values);
}

Belief foretold(const JointModel& joint, const Belief& skull, const PersonFacts& facts) {
  std::vector<int> variables;
  std::vector<double> values;
  std::vector<Index> modes;
  const std::vector<std::string> names = coefficient_names("skull", skull.mean.size());
  for (std::size_t k = 0; k < names.size(); ++k) {
    const auto at = joint.index_of(names[k]);
    if (!at) continue;
    variables.push_back(*at);
    modes.push_back(static_cast<Index>(k));
    values.push_back(skull.mean[modes.back()]);
  }
  for (const Covariate& covariate : covariates()) {
    const auto at = joint.index_of(covariate.name);
    const auto& value = facts.*covariate.value;
    if (!at || !value) continue;
    variables.push_back(*at);
    values.push_back(*value);
  }
  // Facts are taken as exact.
  const auto count = static_cast<Index>(values.size());
  const auto skull_count = static_cast<Index>(modes.size());
  Eigen::MatrixXd error = Eigen::MatrixXd::Zero(count, count);
  error.topLeftCorner(skull_count, skull_count) = skull.covariance(modes, modes);
  return conditioned(joint, variables, Eigen::Map<Eigen::VectorXd>(values.data(), count), error);
}

}  // namespace skullstation
