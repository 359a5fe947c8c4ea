#pragma once

#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "reconstruction/statistics/belief.h"

namespace skullstation {

/// Numbers of a subject that are told together: the coefficients of one model, or one fact.
struct VariableBlock {
  std::string name;
  std::vector<std::string> variables;
  /// #variables: what an error of one of its units weighs when it is foretold from other blocks;
  /// empty: all alike.
  Eigen::VectorXd weights;
  std::vector<std::string> ignores;  ///< earlier blocks that are to tell nothing of it
};

/// A Gaussian over everything that is told about a subject in numbers: coefficients of skull,
/// tissue and head, sex, age, body mass index. Knowing some gives a belief about the others.
struct JointModel {
  std::vector<std::string> names;   ///< #variables
  Eigen::VectorXd mean;             ///< #variables
  Eigen::MatrixXd covariance;       ///< #variables x #variables
  std::vector<std::string> blocks;  ///< of variables, each of which follows from those before it
  /// #blocks x #blocks: how little the block of the column tells of that of the row, as a ridge
  /// penalty in variances of the former's variables (0.01: all that was seen, 1000: nothing); 0
  /// where the column doesn't come before the row.
  Eigen::MatrixXd penalties;
  int subjects = 0;

  /// Index of a variable, if there is one of that name.
  std::optional<int> index_of(std::string_view name) const;

  Result<void> validate() const;
};

struct JointModelOptions {
  /// Of every block; nothing: those with the least error left one out.
  std::optional<double> penalty;
  int iterations = 30;  ///< of the expectation maximisation for unknown entries

  Result<void> validate() const;
};

/// The joint Gaussian of `values` (#variables x #subjects, NaN: unknown; rows in the order of the
/// blocks) as a chain: each block follows from all before it by a ridge regression (Hoerl & Kennard
/// 1970) with a penalty for each of them, since there are more correlations than subjects can tell,
/// and a skull tells much of its head and little of the fat on it. The penalties are those that
/// foretell each subject best from the others (coordinate descent over the closed form of leaving
/// one out). Unknown entries by expectation maximisation (Little & Rubin 2002, 11.2). Fails with
/// `bad_input` for fewer than 4 subjects, lengths that differ, a variable without variance or known
/// in fewer than 2 subjects.
Result<JointModel> build_joint_model(std::span<const VariableBlock> blocks,
                                     const Eigen::MatrixXd& values,
                                     const JointModelOptions& options = {});

/// The belief once `variables` are known to be `values`, with errors of the given covariance
/// (empty: exactly).
Belief conditioned(const JointModel& model, std::span<const int> variables,
                   const Eigen::VectorXd& values, const Eigen::MatrixXd& error_covariance = {});

/// The part of a belief about a joint model's variables that concerns `names`, in their order.
/// Those that the model does not know are standardised coefficients of which nothing is known.
Belief belief_about(const JointModel& model, const Belief& belief,
                    std::span<const std::string> names);

/// What a block follows from, with the penalties: "skull (0.03), tissue (1); nothing by male".
std::string told_by(const JointModel& model, std::size_t block);

/// "head 1", "head 2", ...: how the joint model calls the coefficients of a model.
std::vector<std::string> coefficient_names(std::string_view of, Eigen::Index count);

}  // namespace skullstation
