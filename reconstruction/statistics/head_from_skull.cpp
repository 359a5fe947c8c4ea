#include "reconstruction/statistics/head_from_skull.h"

#include <algorithm>
#include <iterator>
#include <limits>
#include <numeric>

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
                            const Eigen::MatrixXd& tissue, std::span<const ModelSubject> subjects,
                            const JointScoreOptions& options) {
  const auto count = static_cast<Index>(subjects.size());
  const Index skull_modes = std::min<Index>(options.skull_modes, skull_model.mode_count());
  const Index head_modes = std::min<Index>(options.head_modes, head_model.mode_count());
  std::vector<std::string> names = coefficient_names("skull", skull_modes);
  std::ranges::copy(coefficient_names("tissue", tissue.rows()), std::back_inserter(names));
  std::vector<int> outputs(static_cast<std::size_t>(head_modes));
  std::iota(outputs.begin(), outputs.end(), static_cast<int>(names.size()));
  std::ranges::copy(coefficient_names("head", head_modes), std::back_inserter(names));
  std::vector<Covariate> known;
  for (const Covariate& covariate : covariates()) {
    if (!tells(subjects, covariate.value)) continue;
    known.push_back(covariate);
    names.emplace_back(covariate.name);
  }
  Eigen::MatrixXd values(static_cast<Index>(names.size()), count);
  for (Index n = 0; n < count; ++n) {
    const auto i = static_cast<std::size_t>(n);
    Eigen::VectorXd covariate_values(static_cast<Index>(known.size()));
    for (std::size_t c = 0; c < known.size(); ++c) {
      covariate_values[static_cast<Index>(c)] =
          (subjects[i].facts.*known[c].value).value_or(not_a_number);
    }
    Eigen::VectorXd column(values.rows());
    column << coefficients_of(skull_model, skulls[i]).head(skull_modes),
        tissue.rows() > 0 ? Eigen::VectorXd(tissue.col(n)) : Eigen::VectorXd(),
        coefficients_of(head_model, heads[i]).head(head_modes), covariate_values;
    values.col(n) = column;
  }
  return build_joint_model(std::move(names), values, outputs);
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
