#include "reconstruction/statistics/joint_model.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const std::vector<VariableBlock> blocks = {
    {"skull", {"skull 1"}, {}, {}}, {"bmi", {"bmi"}, {}, {}}, {"head", {"head 1"}, {}, {}}};

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
  const JointModel model = build_joint_model(blocks, population(2000, 0.3, 1)).value();
  EXPECT_TRUE(model.validate());
  EXPECT_EQ(model.subjects, 2000);
  EXPECT_EQ(model.blocks, (std::vector<std::string>{"skull", "bmi", "head"}));
  // The head follows from both, the body mass index from nothing.
  EXPECT_LE(model.penalties(2, 0), 0.03);
  EXPECT_LE(model.penalties(2, 1), 0.03);
  EXPECT_GE(model.penalties(1, 0), 1.0);
  const int known[] = {0, 1};
  const Belief belief = conditioned(model, known, VectorXd{{1.0, 29.0}});
  EXPECT_NEAR(belief.mean[2], 1.3, 0.06);
  EXPECT_NEAR(std::sqrt(belief.covariance(2, 2)), 0.3, 0.03);
  EXPECT_NEAR(belief.mean[1], 29.0, 1e-6);
  EXPECT_NEAR(belief.covariance(1, 1), 0.0, 1e-6);
}

TEST(JointModel, WhatIsNotKnownWidensTheBelief) {
  const JointModel model = build_joint_model(blocks, population(2000, 0.3, 2)).value();
  const int skull[] = {0};
  const Belief belief = conditioned(model, skull, VectorXd{{1.0}});
  EXPECT_NEAR(belief.mean[2], 0.8, 0.06);
  EXPECT_NEAR(belief.covariance(2, 2), 0.25 + 0.09, 0.05);
  // An input with an error as large as its spread is believed by half.
  const Belief doubtful = conditioned(model, skull, VectorXd{{1.0}}, Eigen::MatrixXd::Ones(1, 1));
  EXPECT_NEAR(doubtful.mean[2], 0.4, 0.05);
  EXPECT_EQ(conditioned(model, {}, {}).mean, model.mean);
}

TEST(JointModel, ReadsNothingIntoWhatTellsNothing) {
  // Of two blocks before it one tells all of the last variable, the other, with half as many
  // variables as there are subjects, nothing.
  Random random(3);
  constexpr int noise = 20, subjects = 40;
  Eigen::MatrixXd values(noise + 2, subjects);
  for (double& x : values.reshaped()) x = random.normal();
  values.row(noise + 1) = values.row(noise) + 0.1 * values.row(noise + 1);
  std::vector<std::string> many;
  for (int i = 0; i < noise; ++i) many.push_back("x" + std::to_string(i));
  const JointModel model = build_joint_model(std::vector<VariableBlock>{{"noise", many, {}, {}},
                                                                        {"cause", {"c"}, {}, {}},
                                                                        {"effect", {"e"}, {}, {}}},
                                             values)
                               .value();
  EXPECT_TRUE(model.validate());
  EXPECT_GE(model.penalties(2, 0), 3.0);
  EXPECT_LE(model.penalties(2, 1), 0.03);
  std::vector<int> all(noise + 1);
  std::iota(all.begin(), all.end(), 0);
  VectorXd known = VectorXd::Constant(noise + 1, 1.0);
  known[noise] = 2.0;
  EXPECT_NEAR(conditioned(model, all, known).mean[noise + 1], 2.0, 0.15);
}

TEST(JointModel, ABlockIgnoresWhatItIsTold) {
  std::vector<VariableBlock> deaf = blocks;
  deaf[2].ignores = {"skull"};
  const JointModel model = build_joint_model(deaf, population(500, 0.3, 9)).value();
  EXPECT_GE(model.penalties(2, 0), 1000.0);
  EXPECT_LE(model.penalties(2, 1), 0.03);
  const int skull[] = {0};
  EXPECT_NEAR(conditioned(model, skull, VectorXd{{2.0}}).mean[2], model.mean[2], 0.1);
  EXPECT_EQ(told_by(model, 2), fmt::format("bmi ({:g}); nothing by skull", model.penalties(2, 1)));
}

TEST(JointModel, ErrorsCountByTheirWeights) {
  // One output follows from the input, the other is noise that is many times as wide in its units:
  // by itself it would have the input told to be silent.
  Random random(8);
  Eigen::MatrixXd values(12, 30);
  for (double& x : values.reshaped()) x = random.normal();
  values.row(10) = values.row(0) + 0.3 * values.row(10);
  values.row(11) *= 100.0;
  std::vector<std::string> inputs;
  for (int i = 0; i < 10; ++i) inputs.push_back("x" + std::to_string(i));
  const auto penalty = [&](double first, double second) {
    const std::vector<VariableBlock> of = {{"in", inputs, {}, {}},
                                           {"out", {"a", "b"}, VectorXd{{first, second}}, {}}};
    return build_joint_model(of, values).value().penalties(1, 0);
  };
  EXPECT_LE(penalty(1.0, 0.0), 0.3);
  EXPECT_GE(penalty(1.0, 1.0), 10.0);
}

TEST(JointModel, UnknownEntriesDontBiasWhatIsLearnt) {
  Eigen::MatrixXd values = population(3000, 0.3, 4);
  // Body mass index known in a third of the subjects: those with a large head.
  for (Index n = 0; n < values.cols(); ++n) {
    if (values(2, n) < 0.3) values(1, n) = std::nan("");
  }
  const JointModel model = build_joint_model(blocks, values, {0.001, 200}).value();
  EXPECT_NEAR(model.mean[1], 25.0, 0.35);
  EXPECT_NEAR(model.covariance(1, 2) / model.covariance(1, 1), 0.125, 0.02);
}

TEST(JointModel, FindsVariablesByName) {
  const JointModel model = build_joint_model(blocks, population(50, 0.3, 5)).value();
  EXPECT_EQ(model.index_of("bmi"), 1);
  EXPECT_EQ(model.index_of("age"), std::nullopt);
}

TEST(JointModel, RefusesWhatCantBeLearntFrom) {
  const auto what = [](const std::vector<VariableBlock>& of, const Eigen::MatrixXd& values) {
    return build_joint_model(of, values).error().what;
  };
  EXPECT_THAT(what({{"a", {"a"}, {}, {}}}, population(9, 0.3, 6)),
              ::testing::HasSubstr("1 names for 3"));
  EXPECT_THAT(what({{"a", {}, {}, {}}}, population(9, 0.3, 6)),
              ::testing::HasSubstr("\"a\" has no variables"));
  EXPECT_THAT(what({{"a", {"a"}, VectorXd::Ones(2), {}}}, population(9, 0.3, 6)),
              ::testing::HasSubstr("2 weights for 1 variables"));
  EXPECT_THAT(what(blocks, population(3, 0.3, 6)), ::testing::HasSubstr("at least 4 subjects"));
  Eigen::MatrixXd constant = population(9, 0.3, 6);
  constant.row(1).setConstant(22.0);
  EXPECT_THAT(what(blocks, constant), ::testing::HasSubstr("\"bmi\""));
  constant.row(1).setConstant(std::nan(""));
  EXPECT_THAT(what(blocks, constant), ::testing::HasSubstr("known in 0"));
}

}  // namespace
}  // namespace skullstation
