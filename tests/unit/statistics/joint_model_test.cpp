#include "reconstruction/statistics/joint_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const std::vector<std::string> names = {"skull 1", "bmi", "head 1"};
constexpr int outputs[] = {2};

/// head = 0.8 skull + 0.5 (bmi - 25) / 4 + noise
Eigen::MatrixXd population(int count, double noise, std::uint64_t seed) {
  Random random(seed);
  Eigen::MatrixXd values(3, count);
  for (Index n = 0; n < count; ++n) {
    values(0, n) = random.normal();
    values(1, n) = random.normal(25.0, 4.0);
    values(2, n) = 0.8 * values(0, n) + 0.5 * (values(1, n) - 25.0) / 4.0 + noise * random.normal();
  }
  return values;
}

TEST(JointModel, PredictsWhatFollows) {
  const JointModel model = build_joint_model(names, population(2000, 0.3, 1), outputs).value();
  EXPECT_TRUE(model.validate());
  EXPECT_EQ(model.subjects, 2000);
  EXPECT_LE(model.shrinkage, 0.02);
  const int known[] = {0, 1};
  const Belief belief = conditioned(model, known, VectorXd{{1.0, 29.0}});
  EXPECT_NEAR(belief.mean[2], 1.3, 0.06);
  EXPECT_NEAR(std::sqrt(belief.covariance(2, 2)), 0.3, 0.03);
  EXPECT_NEAR(belief.mean[1], 29.0, 1e-6);
  EXPECT_NEAR(belief.covariance(1, 1), 0.0, 1e-6);
}

TEST(JointModel, WhatIsNotKnownWidensTheBelief) {
  const JointModel model = build_joint_model(names, population(2000, 0.3, 2), outputs).value();
  const int skull[] = {0};
  const Belief belief = conditioned(model, skull, VectorXd{{1.0}});
  EXPECT_NEAR(belief.mean[2], 0.8, 0.06);
  EXPECT_NEAR(belief.covariance(2, 2), 0.25 + 0.09, 0.05);
  // An input with an error as large as its spread is believed by half.
  const Belief doubtful = conditioned(model, skull, VectorXd{{1.0}}, Eigen::MatrixXd::Ones(1, 1));
  EXPECT_NEAR(doubtful.mean[2], 0.4, 0.05);
  EXPECT_EQ(conditioned(model, {}, {}).mean, model.mean);
}

TEST(JointModel, ShrinksMoreWhereSubjectsAreFewAndTellLess) {
  // Twenty inputs that tell nothing, and thirty subjects.
  Random random(3);
  Eigen::MatrixXd values(21, 30);
  for (double& x : values.reshaped()) x = random.normal();
  std::vector<std::string> many;
  for (int i = 0; i < 21; ++i) many.push_back("x" + std::to_string(i));
  const int last[] = {20};
  const JointModel model = build_joint_model(many, values, last).value();
  EXPECT_GE(model.shrinkage, 0.3);
  EXPECT_TRUE(model.validate());
}

TEST(JointModel, UnknownEntriesDontBiasWhatIsLearnt) {
  Eigen::MatrixXd values = population(3000, 0.3, 4);
  // Body mass index known in a third of the subjects: those with a large head.
  for (Index n = 0; n < values.cols(); ++n) {
    if (values(2, n) < 0.3) values(1, n) = std::nan("");
  }
  const JointModel model = build_joint_model(names, values, outputs, {0.001, 200}).value();
  EXPECT_NEAR(model.mean[1], 25.0, 0.35);
  EXPECT_NEAR(model.covariance(1, 2) / model.covariance(1, 1), 0.125, 0.02);
}

TEST(JointModel, FindsVariablesByName) {
  const JointModel model = build_joint_model(names, population(50, 0.3, 5), outputs).value();
  EXPECT_EQ(model.index_of("bmi"), 1);
  EXPECT_EQ(model.index_of("age"), std::nullopt);
}

TEST(JointModel, RefusesWhatCantBeLearntFrom) {
  const auto what = [](std::vector<std::string> of, const Eigen::MatrixXd& values) {
    return build_joint_model(std::move(of), values, outputs).error().what;
  };
  EXPECT_THAT(what({"a"}, population(9, 0.3, 6)), ::testing::HasSubstr("1 names for 3"));
  EXPECT_THAT(what(names, population(3, 0.3, 6)), ::testing::HasSubstr("at least 4 subjects"));
  Eigen::MatrixXd constant = population(9, 0.3, 6);
  constant.row(1).setConstant(22.0);
  EXPECT_THAT(what(names, constant), ::testing::HasSubstr("\"bmi\""));
  constant.row(1).setConstant(std::nan(""));
  EXPECT_THAT(what(names, constant), ::testing::HasSubstr("known in 0"));
}

}  // namespace
}  // namespace skullstation
