#include "reconstruction/statistics/model_quality.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::Index;

/// Two modes and nothing else.
std::vector<Points3> planar_population(int count) {
  Random random(1);
  Eigen::VectorXd mean(90);
  Eigen::VectorXd first(90);
  Eigen::VectorXd second(90);
  for (Eigen::VectorXd* vector : {&mean, &first, &second}) {
    for (double& x : *vector) x = random.normal();
  }
  std::vector<Points3> shapes;
  for (int i = 0; i < count; ++i) {
    shapes.push_back(
        unflattened(50.0 * mean + 4.0 * random.normal() * first + random.normal() * second));
  }
  return shapes;
}

TEST(ModelQuality, TwoModesExplainATwoModePopulation) {
  const std::vector<Points3> shapes = planar_population(20);
  const ModelQuality quality =
      model_quality(shapes, Eigen::VectorXd::Ones(30), {6, 50, 1, 2}).value();
  ASSERT_GE(quality.generalisation_mm.size(), 2U);
  EXPECT_GT(quality.compactness[0], 0.8);
  EXPECT_LT(quality.compactness[0], 0.999);
  EXPECT_NEAR(quality.compactness[1], 1.0, 1e-9);
  EXPECT_GT(quality.generalisation_mm[0], 0.5);
  EXPECT_NEAR(quality.generalisation_mm[1], 0.0, 1e-9);
  // Random members lie between the training shapes: not on them, not far from them.
  EXPECT_GT(quality.specificity_mm[1], 0.1);
  EXPECT_LT(quality.specificity_mm[1], 4.0);
}

TEST(ModelQuality, IsTheSameForAnyNumberOfThreads) {
  const std::vector<Points3> shapes = planar_population(8);
  const auto run = [&](int threads) {
    return model_quality(shapes, Eigen::VectorXd::Ones(30), {4, 20, 7, threads}).value();
  };
  EXPECT_EQ(run(1).specificity_mm, run(3).specificity_mm);
  EXPECT_EQ(run(1).generalisation_mm, run(3).generalisation_mm);
}

TEST(ModelQuality, NeedsShapesToLeaveOut) {
  const std::vector<Points3> shapes = planar_population(3);
  EXPECT_EQ(model_quality(shapes, Eigen::VectorXd::Ones(30)).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace skullstation
