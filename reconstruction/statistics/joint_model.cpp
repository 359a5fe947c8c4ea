#include "reconstruction/statistics/joint_model.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <utility>

namespace skullstation {

namespace {

using Eigen::Index;

tl::unexpected<Error> bad(std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, "joint model", std::move(what), std::move(advice));
}

constexpr double kTellsNothing = 1000.0;

struct Moments {
  Eigen::VectorXd mean;
  Eigen::MatrixXd covariance;
};

/// A tenth less of each correlation: few subjects span few directions, and what lies in none of
/// them is not known exactly.
Eigen::MatrixXd shrunk(const Eigen::MatrixXd& covariance) {
  Eigen::MatrixXd result = 0.9 * covariance;
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

/// The variables [begin, begin + count) of a block.
struct Rows {
  Index begin = 0;
  Index count = 0;
};

/// Subjects with their unknown entries filled in, and what the filling adds to the covariance.
struct CompletedValues {
  Eigen::MatrixXd centred;     ///< #variables x #subjects
  Eigen::VectorXd mean;        ///< #variables
  Eigen::MatrixXd covariance;  ///< #variables x #variables
};

CompletedValues completed(const Eigen::MatrixXd& values, const Moments& moments) {
  const Index variables = values.rows();
  CompletedValues result;
  result.centred = values;
  Eigen::MatrixXd doubt = Eigen::MatrixXd::Zero(variables, variables);
  for (Index n = 0; n < values.cols(); ++n) {
    const std::vector<int> known = known_entries(values.col(n));
    if (static_cast<Index>(known.size()) == variables) continue;
    const Belief belief = conditioned_on(moments, known, picked(values.col(n), known), {});
    result.centred.col(n) = belief.mean;
    doubt += belief.covariance;
  }
  result.mean = result.centred.rowwise().mean();
  result.centred.colwise() -= result.mean;
  result.covariance = (result.centred * result.centred.transpose() + doubt) /
                      static_cast<double>(std::max<Index>(1, values.cols() - 1));
  return result;
}

/// Each variable on its own, of those who have it.
Moments independent_moments(const Eigen::MatrixXd& values) {
  Moments moments{Eigen::VectorXd::Zero(values.rows()),
                  Eigen::MatrixXd::Zero(values.rows(), values.rows())};
  for (Index i = 0; i < values.rows(); ++i) {
    const std::vector<int> known = known_entries(values.row(i).transpose());
    const Eigen::VectorXd seen = picked(values.row(i).transpose(), known);
    moments.mean[i] = seen.mean();
    moments.covariance(i, i) =
        (seen.array() - seen.mean()).square().sum() / (static_cast<double>(known.size()) - 1.0);
  }
  return moments;
}

/// The inputs' covariance with each block's penalty on its diagonal.
Eigen::MatrixXd penalised(const Eigen::MatrixXd& covariance, std::span<const Rows> inputs,
                          std::span<const double> penalties) {
  const Index count = inputs.back().begin + inputs.back().count;
  Eigen::MatrixXd result = covariance.topLeftCorner(count, count);
  for (std::size_t b = 0; b < inputs.size(); ++b) {
    result.diagonal().segment(inputs[b].begin, inputs[b].count) *= 1.0 + penalties[b];
  }
  return result;
}

/// Errors of a block (#outputs x #subjects) where each subject is foretold by the others: the
/// residuals of the ridge regression over 1 - leverage.
Eigen::MatrixXd errors_left_out(const CompletedValues& subjects, std::span<const Rows> inputs,
                                Rows outputs, std::span<const double> penalties) {
  const auto subject_count = static_cast<double>(subjects.centred.cols());
  const Index count = inputs.back().begin + inputs.back().count;
  const auto x = subjects.centred.topRows(count);
  const auto y = subjects.centred.middleRows(outputs.begin, outputs.count);
  const Eigen::MatrixXd carried =
      Eigen::LLT<Eigen::MatrixXd>((subject_count - 1.0) *
                                  penalised(subjects.covariance, inputs, penalties))
          .solve(x);
  const Eigen::MatrixXd residuals = y - (y * x.transpose()) * carried;
  // The mean is learnt as well.
  const Eigen::ArrayXd leverages =
      x.cwiseProduct(carried).colwise().sum().transpose().array() + 1.0 / subject_count;
  return residuals * (1.0 - leverages.min(1.0 - 1e-9)).inverse().matrix().asDiagonal();
}

/// How much each of the inputs' blocks tells of the outputs; `fixed` ones as they are.
std::vector<double> chosen_penalties(const CompletedValues& subjects, std::span<const Rows> inputs,
                                     Rows outputs, const Eigen::VectorXd& weights,
                                     std::span<const std::optional<double>> fixed) {
  constexpr std::array candidates = {0.003, 0.01, 0.03, 0.1,  0.3,
                                     1.0,   3.0,  10.0, 30.0, kTellsNothing};
  constexpr int most_sweeps = 4;
  std::vector<double> penalties;
  for (const std::optional<double>& penalty : fixed) penalties.push_back(penalty.value_or(1.0));
  for (int sweep = 0; sweep < most_sweeps; ++sweep) {
    const std::vector<double> before = penalties;
    for (std::size_t b = 0; b < penalties.size(); ++b) {
      if (fixed[b]) continue;
      std::array<double, candidates.size()> errors{};
      for (std::size_t c = 0; c < candidates.size(); ++c) {
        penalties[b] = candidates[c];
        errors[c] = (weights.asDiagonal() * errors_left_out(subjects, inputs, outputs, penalties))
                        .squaredNorm();
      }
      penalties[b] =
          candidates[static_cast<std::size_t>(std::ranges::min_element(errors) - errors.begin())];
    }
    if (penalties == before) break;
  }
  return penalties;
}

struct Chain {
  Moments moments;
  Eigen::MatrixXd penalties;  ///< #blocks x #blocks
};

/// Covariance of what a regression leaves over in subjects whom it has not seen: the residuals'
/// correlations, and their variances as much larger as errors left out are larger than residuals. A
/// regression with half as many inputs as subjects thinks far too well of itself.
Eigen::MatrixXd left_over(const CompletedValues& subjects, std::span<const Rows> inputs,
                          Rows outputs, std::span<const double> penalties,
                          const Eigen::MatrixXd& slope) {
  const auto [begin, count] = outputs;
  const Eigen::MatrixXd across = subjects.covariance.block(begin, 0, count, begin);
  const Eigen::MatrixXd residuals =
      subjects.covariance.block(begin, begin, count, count) - slope * across.transpose() -
      across * slope.transpose() +
      slope * subjects.covariance.topLeftCorner(begin, begin) * slope.transpose();
  const Eigen::ArrayXd seen =
      (subjects.centred.middleRows(begin, count) - slope * subjects.centred.topRows(begin))
          .rowwise()
          .squaredNorm();
  const Eigen::ArrayXd left_out =
      errors_left_out(subjects, inputs, outputs, penalties).rowwise().squaredNorm();
  const Eigen::VectorXd scale = (left_out / seen).sqrt();
  return scale.asDiagonal() * shrunk(residuals) * scale.asDiagonal();
}

/// Block after block: y = B x + rest with B = Syx (Sxx + penalties)^-1.
Chain chained(const CompletedValues& subjects, std::span<const Rows> rows,
              std::span<const VariableBlock> blocks, std::optional<double> penalty) {
  Chain chain;
  const auto block_count = static_cast<Index>(rows.size());
  chain.penalties = Eigen::MatrixXd::Zero(block_count, block_count);
  chain.moments.mean = subjects.mean;
  Eigen::MatrixXd& covariance = chain.moments.covariance;
  covariance = Eigen::MatrixXd::Zero(subjects.mean.size(), subjects.mean.size());
  const Index first = rows.front().count;
  covariance.topLeftCorner(first, first) = shrunk(subjects.covariance.topLeftCorner(first, first));
  for (std::size_t b = 1; b < rows.size(); ++b) {
    const std::span<const Rows> inputs = rows.first(b);
    const auto [begin, count] = rows[b];
    const Eigen::VectorXd weights =
        blocks[b].weights.size() > 0 ? blocks[b].weights : Eigen::VectorXd::Ones(count);
    std::vector<std::optional<double>> fixed(b, penalty);
    for (std::size_t from = 0; from < b; ++from) {
      if (std::ranges::count(blocks[b].ignores, blocks[from].name) > 0) fixed[from] = kTellsNothing;
    }
    const std::vector<double> penalties =
        chosen_penalties(subjects, inputs, rows[b], weights, fixed);
    chain.penalties.row(static_cast<Index>(b)).head(static_cast<Index>(b)) =
        Eigen::Map<const Eigen::RowVectorXd>(penalties.data(), static_cast<Index>(b));
    const Eigen::MatrixXd across = subjects.covariance.block(begin, 0, count, begin);
    const Eigen::MatrixXd slope =
        Eigen::LLT<Eigen::MatrixXd>(penalised(subjects.covariance, inputs, penalties))
            .solve(across.transpose())
            .transpose();
    const Eigen::MatrixXd rest = left_over(subjects, inputs, rows[b], penalties, slope);
    const Eigen::MatrixXd follows = slope * covariance.topLeftCorner(begin, begin);
    covariance.block(begin, 0, count, begin) = follows;
    covariance.block(0, begin, begin, count) = follows.transpose();
    const Eigen::MatrixXd own = follows * slope.transpose() + rest;
    covariance.block(begin, begin, count, count) = 0.5 * (own + own.transpose());
  }
  return chain;
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
  const auto block_count = static_cast<Index>(blocks.size());
  if (penalties.rows() != block_count || penalties.cols() != block_count) {
    return bad("its penalties are not of its blocks");
  }
  if (!mean.allFinite() || !covariance.allFinite()) return bad("a number in it is none");
  if (Eigen::LLT<Eigen::MatrixXd>(covariance).info() != Eigen::Success) {
    return bad("its covariance is not positive definite");
  }
  return {};
}

Result<void> JointModelOptions::validate() const {
  if (penalty && !(*penalty > 0.0)) return bad("penalty must be above 0");
  if (iterations < 1) return bad("iterations must be at least 1");
  return {};
}

Result<JointModel> build_joint_model(std::span<const VariableBlock> blocks,
                                     const Eigen::MatrixXd& values,
                                     const JointModelOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  JointModel model;
  std::vector<Rows> rows;
  for (const VariableBlock& block : blocks) {
    const auto count = static_cast<Index>(block.variables.size());
    if (count == 0) return bad(fmt::format("block \"{}\" has no variables", block.name));
    if (block.weights.size() != 0 && block.weights.size() != count) {
      return bad(fmt::format("block \"{}\" has {} weights for {} variables", block.name,
                             block.weights.size(), count));
    }
    rows.push_back({static_cast<Index>(model.names.size()), count});
    model.blocks.push_back(block.name);
    std::ranges::copy(block.variables, std::back_inserter(model.names));
  }
  if (model.names.empty() || static_cast<Index>(model.names.size()) != values.rows()) {
    return bad(fmt::format("{} names for {} variables", model.names.size(), values.rows()));
  }
  if (values.cols() < 4) return bad("needs at least 4 subjects", "add subjects");
  for (Index i = 0; i < values.rows(); ++i) {
    const std::vector<int> known = known_entries(values.row(i).transpose());
    const Eigen::VectorXd seen = picked(values.row(i).transpose(), known);
    if (known.size() < 2 || !(seen.maxCoeff() > seen.minCoeff())) {
      return bad(fmt::format("\"{}\" is known in {} subjects and does not vary",
                             model.names[static_cast<std::size_t>(i)], known.size()));
    }
  }
  Chain chain{independent_moments(values), {}};
  const int rounds = values.hasNaN() ? options.iterations : 1;
  for (int round = 0; round < rounds; ++round) {
    chain = chained(completed(values, chain.moments), rows, blocks, options.penalty);
  }
  model.penalties = std::move(chain.penalties);
  model.mean = std::move(chain.moments.mean);
  model.covariance = std::move(chain.moments.covariance);
  model.subjects = static_cast<int>(values.cols());
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

std::string told_by(const JointModel& model, std::size_t block) {
  std::string tells;
  std::string silent;
  for (std::size_t from = 0; from < block; ++from) {
    const double penalty = model.penalties(static_cast<Index>(block), static_cast<Index>(from));
    std::string& list = penalty < kTellsNothing ? tells : silent;
    if (!list.empty()) list += ", ";
    list += model.blocks[from];
    if (penalty < kTellsNothing) list += fmt::format(" ({:g})", penalty);
  }
  if (tells.empty()) tells = "nothing";
  return silent.empty() ? tells : tells + "; nothing by " + silent;
}

std::vector<std::string> coefficient_names(std::string_view of, Index count) {
  std::vector<std::string> names;
  for (Index k = 1; k <= count; ++k) names.push_back(fmt::format("{} {}", of, k));
  return names;
}

}  // namespace skullstation
