#include "reconstruction/statistics/joint_model.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

namespace skullstation {

namespace {

using Eigen::Index;

tl::unexpected<Error> bad(std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, "joint model", std::move(what), std::move(advice));
}

struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

Eigen::MatrixXd shrunk(const Eigen::MatrixXd& covariance, double shrinkage) {
  Eigen::MatrixXd result = (1.0 - shrinkage) * covariance;
  result.diagonal() = covariance.diagonal();
  return result;
}

/// Belief about all variables of a Gaussian where some are known.
Belief conditioned_on(const Moments& moments, std::span<const int> known,
                      const Eigen::VectorXd& values, const Eigen::MatrixXd& error) {
  const auto count = static_cast<Index>(known.size());
  Eigen::MatrixXd inner(count, count);
  Eigen::MatrixXd across(moments.mean.size(), count);
  Eigen::VectorXd difference(count);
  for (Index i = 0; i < count; ++i) {
    const int at = known[static_cast<std::size_t>(i)];
    across.col(i) = moments.covariance.col(at);
    difference[i] = values[i] - moments.mean[at];
    for (Index j = 0; j < count; ++j) {
      inner(i, j) = moments.covariance(at, known[static_cast<std::size_t>(j)]);
    }
  }
  if (error.size() > 0) inner += error;
  // Keeps the factor sound where two variables tell the same.
  inner.diagonal().array() *= 1.0 + 1e-9;
  const Eigen::LDLT<Eigen::MatrixXd> factor(inner);
  Belief belief;
  belief.mean = moments.mean + across * factor.solve(difference);
  belief.covariance = moments.covariance - across * factor.solve(across.transpose());
  belief.covariance = 0.5 * (belief.covariance + belief.covariance.transpose()).eval();
  return belief;
}

std::vector<int> known_entries(const Eigen::VectorXd& subject) {
  std::vector<int> known;
  for (Index i = 0; i < subject.size(); ++i) {
    if (!std::isnan(subject[i])) known.push_back(static_cast<int>(i));
  }
  return known;
}

Eigen::VectorXd picked(const Eigen::VectorXd& values, std::span<const int> indices) {
  Eigen::VectorXd result(static_cast<Index>(indices.size()));
  for (std::size_t i = 0; i < indices.size(); ++i) {
    result[static_cast<Index>(i)] = values[indices[i]];
  }
  return result;
}

/// Mean and covariance of the subjects for whom `use` is true.
Moments moments_of(const Eigen::MatrixXd& values, const std::vector<bool>& use, int iterations) {
  const Index variables = values.rows();
  Moments moments{Eigen::VectorXd::Zero(variables), Eigen::MatrixXd::Zero(variables, variables)};
  Eigen::VectorXd squares = Eigen::VectorXd::Zero(variables);
  Eigen::VectorXd counts = Eigen::VectorXd::Zero(variables);
  bool complete = true;
  for (Index n = 0; n < values.cols(); ++n) {
    if (!use[static_cast<std::size_t>(n)]) continue;
    for (Index i = 0; i < variables; ++i) {
      if (std::isnan(values(i, n))) {
        complete = false;
        continue;
      }
      moments.mean[i] += values(i, n);
      squares[i] += values(i, n) * values(i, n);
      counts[i] += 1.0;
    }
  }
  moments.mean.array() /= counts.array().max(1.0);
  moments.covariance.diagonal() =
      (squares.array() / counts.array().max(1.0) - moments.mean.array().square()).max(1e-12);
  const auto subjects = static_cast<double>(std::count(use.begin(), use.end(), true));
  for (int iteration = 0; iteration < (complete ? 1 : iterations); ++iteration) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(variables);
    Eigen::MatrixXd second = Eigen::MatrixXd::Zero(variables, variables);
    for (Index n = 0; n < values.cols(); ++n) {
      if (!use[static_cast<std::size_t>(n)]) continue;
      const std::vector<int> known = known_entries(values.col(n));
      if (static_cast<Index>(known.size()) == variables) {
        sum += values.col(n);
        second += values.col(n) * values.col(n).transpose();
        continue;
      }
      // A little shrinkage keeps the estimate sound while it settles.
      const Belief belief = conditioned_on({moments.mean, shrunk(moments.covariance, 1e-3)}, known,
                                           picked(values.col(n), known), {});
      sum += belief.mean;
      second += belief.mean * belief.mean.transpose() + belief.covariance;
    }
    moments.mean = sum / subjects;
    moments.covariance = (second - subjects * moments.mean * moments.mean.transpose()) /
                         std::max(1.0, subjects - 1.0);
  }
  return moments;
}

/// Mean squared error of the outputs in units of their variance, each subject predicted without
/// itself, for each of the candidate shrinkages.
std::vector<double> errors_left_out(const Eigen::MatrixXd& values, std::span<const int> outputs,
                                    std::span<const double> shrinkages, int iterations) {
  std::vector<bool> is_output(static_cast<std::size_t>(values.rows()), false);
  for (const int output : outputs) is_output[static_cast<std::size_t>(output)] = true;
  std::vector<double> errors(shrinkages.size(), 0.0);
  std::vector<bool> use(static_cast<std::size_t>(values.cols()), true);
  for (Index n = 0; n < values.cols(); ++n) {
    use[static_cast<std::size_t>(n)] = false;
    const Moments moments = moments_of(values, use, iterations);
    use[static_cast<std::size_t>(n)] = true;
    std::vector<int> inputs;
    for (const int i : known_entries(values.col(n))) {
      if (!is_output[static_cast<std::size_t>(i)]) inputs.push_back(i);
    }
    for (std::size_t s = 0; s < shrinkages.size(); ++s) {
      const Belief belief =
          conditioned_on({moments.mean, shrunk(moments.covariance, shrinkages[s])}, inputs,
                         picked(values.col(n), inputs), {});
      for (const int output : outputs) {
        const double error = values(output, n) - belief.mean[output];
        if (!std::isnan(error)) errors[s] += error * error / moments.covariance(output, output);
      }
    }
  }
  return errors;
}

}  // namespace

std::optional<int> JointModel::index_of(std::string_view name) const {
  const auto found = std::ranges::find(names, name);
  if (found == names.end()) return std::nullopt;
  return static_cast<int>(found - names.begin());
}

Result<void> JointModel::validate() const {
  const auto variables = static_cast<Index>(names.size());
  if (variables == 0 || mean.size() != variables || covariance.rows() != variables ||
      covariance.cols() != variables) {
    return bad("its tables are not of one length");
  }
  if (!mean.allFinite() || !covariance.allFinite()) return bad("a number in it is none");
  if (Eigen::LLT<Eigen::MatrixXd>(covariance).info() != Eigen::Success) {
    return bad("its covariance is not positive definite");
  }
  return {};
}

Result<void> JointModelOptions::validate() const {
  if (shrinkage && !(*shrinkage > 0.0 && *shrinkage <= 1.0)) {
    return bad("shrinkage must be above 0, up to 1");
  }
  if (iterations < 1) return bad("iterations must be at least 1");
  return {};
}

Result<JointModel> build_joint_model(std::vector<std::string> names, const Eigen::MatrixXd& values,
                                     std::span<const int> outputs,
                                     const JointModelOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (static_cast<Index>(names.size()) != values.rows()) {
    return bad(fmt::format("{} names for {} variables", names.size(), values.rows()));
  }
  if (values.cols() < 4) return bad("needs at least 4 subjects", "add subjects");
  if (outputs.empty() && !options.shrinkage) return bad("has no output to choose its shrinkage by");
  const std::vector<bool> all(static_cast<std::size_t>(values.cols()), true);
  for (Index i = 0; i < values.rows(); ++i) {
    const std::vector<int> known = known_entries(values.row(i).transpose());
    const Eigen::VectorXd seen = picked(values.row(i).transpose(), known);
    if (known.size() < 2 || !(seen.maxCoeff() > seen.minCoeff())) {
      return bad(fmt::format("\"{}\" is known in {} subjects and does not vary",
                             names[static_cast<std::size_t>(i)], known.size()));
    }
  }
  JointModel model;
  model.subjects = static_cast<int>(values.cols());
  if (options.shrinkage) {
    model.shrinkage = *options.shrinkage;
  } else {
    constexpr std::array candidates = {0.001, 0.003, 0.01, 0.02, 0.05, 0.1, 0.15,
                                       0.2,   0.3,   0.4,  0.5,  0.65, 0.8, 0.95};
    const std::vector<double> errors =
        errors_left_out(values, outputs, candidates, options.iterations);
    model.shrinkage =
        candidates[static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin())];
  }
  const Moments moments = moments_of(values, all, options.iterations);
  model.names = std::move(names);
  model.mean = moments.mean;
  model.covariance = shrunk(moments.covariance, model.shrinkage);
  return model;
}

Belief conditioned(const JointModel& model, std::span<const int> variables,
                   const Eigen::VectorXd& values, const Eigen::MatrixXd& error_covariance) {
  if (variables.empty()) return {model.mean, model.covariance};
  return conditioned_on({model.mean, model.covariance}, variables, values, error_covariance);
}

Belief belief_about(const JointModel& model, const Belief& belief,
                    std::span<const std::string> names) {
  Belief result = Belief::standard_normal(static_cast<Index>(names.size()));
  std::vector<std::pair<Index, int>> known;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (const auto at = model.index_of(names[i])) known.emplace_back(static_cast<Index>(i), *at);
  }
  for (const auto& [i, variable] : known) {
    result.mean[i] = belief.mean[variable];
    for (const auto& [j, other] : known)
      result.covariance(i, j) = belief.covariance(variable, other);
  }
  return result;
}

std::vector<std::string> coefficient_names(std::string_view of, Index count) {
  std::vector<std::string> names;
  for (Index k = 1; k <= count; ++k) names.push_back(fmt::format("{} {}", of, k));
  return names;
}

}  // namespace skullstation
