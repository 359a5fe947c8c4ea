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

/// A Gaussian over everything that is told about a subject in numbers: coefficients of skull,
/// tissue and head, sex, age, body mass index. Knowing some gives a belief about the others.
struct JointModel {
  std::vector<std::string> names;  ///< #variables
  Eigen::VectorXd mean;            ///< #variables
  Eigen::MatrixXd covariance;      ///< #variables x #variables, shrunk
  double shrinkage = 0.0;          ///< share of the correlations that was taken away
  int subjects = 0;

  /// Index of a variable, if there is one of that name.
  std::optional<int> index_of(std::string_view name) const;

  Result<void> validate() const;
};

struct JointModelOptions {
  /// Share of the correlations to take away; nothing: the one with the least error of the outputs
  /// left one out.
  std::optional<double> shrinkage;
  int iterations = 30;  ///< of the expectation maximisation for unknown entries

  Result<void> validate() const;
};

/// The joint Gaussian of `values` (#variables x #subjects, NaN: unknown), its correlations shrunk
/// towards none (Schaefer & Strimmer 2005), since there are more of them than subjects can tell;
/// how far is chosen by leaving one subject out at a time and predicting `outputs` (indices) from
/// all other variables. Unknown entries by expectation maximisation (Little & Rubin 2002, 11.2).
/// Fails with `bad_input` for fewer than 4 subjects, lengths that differ, a variable without
/// variance or known in fewer than 2 subjects.
Result<JointModel> build_joint_model(std::vector<std::string> names, const Eigen::MatrixXd& values,
                                     std::span<const int> outputs,
                                     const JointModelOptions& options = {});

/// The belief once `variables` are known to be `values`, with errors of the given covariance
/// (empty: exactly).
Belief conditioned(const JointModel& model, std::span<const int> variables,
                   const Eigen::VectorXd& values, const Eigen::MatrixXd& error_covariance = {});

/// The part of a belief about a joint model's variables that concerns `names`, in their order.
/// Those that the model does not know are standardised coefficients of which nothing is known.
Belief belief_about(const JointModel& model, const Belief& belief,
                    std::span<const std::string> names);

/// "head 1", "head 2", ...: how the joint model calls the coefficients of a model.
std::vector<std::string> coefficient_names(std::string_view of, Eigen::Index count);

}  // namespace skullstation
