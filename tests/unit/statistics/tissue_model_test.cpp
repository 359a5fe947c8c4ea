#include "reconstruction/statistics/tissue_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/random.h"
#include "tests/unit/statistics/test_surfaces.h"

namespace skullstation {
namespace {

using Eigen::Index;
using skullstation::testing::sphere;

constexpr double missing = std::numeric_limits<double>::quiet_NaN();

/// Depths on a sphere: log t = log 8 + 0.2 z + a (0.3, everywhere) + b (0.2 x) + noise 0.05.
struct Population {
  TriangleMesh surface = sphere(80.0, 10, 16);
  Eigen::MatrixXd depths;
  Eigen::VectorXd log_mean;
  Eigen::MatrixXd modes;

  explicit Population(int subjects) {
    Random random(17);
    const Index vertices = surface.vertices.rows();
    log_mean = std::log(8.0) + 0.2 * surface.vertices.col(2).array() / 80.0;
    modes.resize(vertices, 2);
    modes.col(0).setConstant(0.3);
    modes.col(1) = 0.2 * surface.vertices.col(0) / 80.0;
    depths.resize(vertices, subjects);
    for (Index n = 0; n < subjects; ++n) {
      const Eigen::Vector2d z(random.normal(), random.normal());
      for (Index v = 0; v < vertices; ++v) {
        depths(v, n) = std::exp(log_mean[v] + modes.row(v).dot(z) + 0.05 * random.normal());
      }
    }
  }

  Eigen::MatrixXd covariance() const { return modes * modes.transpose(); }
};

TissueModelOptions two_modes() {
  TissueModelOptions options;
  options.modes = 2;
  return options;
}

TEST(TissueModel, FindsMeansModesAndNoise) {
  const Population people(150);
  const TissueModel model = build_tissue_model(people.depths, people.surface, two_modes()).value();
  EXPECT_TRUE(model.validate());
  EXPECT_EQ(model.count.minCoeff(), 150);
  EXPECT_LT((model.log_mean - people.log_mean).cwiseAbs().maxCoeff(), 0.08);
  const Eigen::MatrixXd covariance = model.modes * model.modes.transpose();
  EXPECT_LT((covariance - people.covariance()).norm() / people.covariance().norm(), 0.2);
  EXPECT_NEAR(model.noise_sd.mean(), 0.05, 0.012);
  // Raw figures beside the model.
  const double first_mean = people.depths.row(0).mean();
  EXPECT_DOUBLE_EQ(model.mean_mm[0], first_mean);
  EXPECT_NEAR(model.sd_mm[0],
              std::sqrt((people.depths.row(0).array() - first_mean).square().sum() / 149.0), 1e-9);
}

TEST(TissueModel, GapsDontMoveTheModel) {
  const Population people(80);
  Eigen::MatrixXd gappy = people.depths;
  // Thick subjects lack the upper half, as cropped scans do: the plain mean there is too thin.
  for (Index n = 0; n < gappy.cols(); ++n) {
    const bool thick = people.depths.col(n).mean() > 8.0;
    for (Index v = 0; v < gappy.rows(); ++v) {
      if (thick && people.surface.vertices(v, 2) > 0.0) gappy(v, n) = missing;
    }
  }
  const TissueModel model = build_tissue_model(gappy, people.surface, two_modes()).value();
  const TissueModel whole = build_tissue_model(people.depths, people.surface, two_modes()).value();
  double plain_error = 0.0;
  double model_error = 0.0;
  int upper = 0;
  for (Index v = 0; v < gappy.rows(); ++v) {
    if (people.surface.vertices(v, 2) <= 0.0) continue;
    plain_error += std::log(model.mean_mm[v]) - std::log(whole.mean_mm[v]);
    model_error += model.log_mean[v] - whole.log_mean[v];
    ++upper;
  }
  EXPECT_LT(plain_error / upper, -0.15);
  EXPECT_GT(model_error / upper, -0.06);
}

TEST(TissueModel, OutliersHaveNoSay) {
  const Population people(40);
  Eigen::MatrixXd spoilt = people.depths;
  // A tube over a part of the skin of three subjects.
  for (const Index n : {3, 17, 28}) spoilt.block(20, n, 15, 1).setConstant(55.0);
  const TissueModel clean = build_tissue_model(people.depths, people.surface, two_modes()).value();
  const TissueModel robust = build_tissue_model(spoilt, people.surface, two_modes()).value();
  EXPECT_GT((robust.mean_mm - clean.mean_mm).maxCoeff(), 2.0);
  // The plain mean of logarithms would move by 3/40 log(55/8) = 0.14.
  EXPECT_LT((robust.log_mean - clean.log_mean).cwiseAbs().maxCoeff(), 0.06);
  EXPECT_LT((robust.noise_sd - clean.noise_sd).cwiseAbs().maxCoeff(), 0.03);
}

TEST(TissueModel, FewSubjectsAreDrawnTowardsTheirSurroundings) {
  const Population people(30);
  Eigen::MatrixXd sparse = people.depths;
  const Index lonely = 40;
  for (Index n = 5; n < 30; ++n) sparse(lonely, n) = missing;
  for (Index n = 0; n < 5; ++n) sparse(lonely, n) = 25.0 + static_cast<double>(n);
  sparse.row(41).tail(27).setConstant(missing);  // three subjects: too few
  const TissueModel model = build_tissue_model(sparse, people.surface, two_modes()).value();
  EXPECT_TRUE(model.modelled[lonely]);
  EXPECT_FALSE(model.modelled[41]);
  EXPECT_TRUE(std::isnan(tissue_at(model, Eigen::VectorXd::Zero(2))[41]));
  EXPECT_LT(std::exp(model.log_mean[lonely]), 20.0);
}

TEST(TissueBelief, APartOfTheFaceTellsTheRest) {
  const Population people(150);
  const TissueModel model = build_tissue_model(people.depths, people.surface, two_modes()).value();
  Eigen::VectorXd half = people.depths.col(7);
  for (Index v = 0; v < half.size(); v += 2) half[v] = missing;
  const Eigen::VectorXd expected = expected_tissue(model, tissue_belief(model, half));
  const double error =
      ((expected - people.depths.col(7)).cwiseQuotient(people.depths.col(7))).cwiseAbs().mean();
  EXPECT_LT(error, 0.06);
  // Nothing measured: the population.
  const Belief nothing = tissue_belief(model, Eigen::VectorXd::Constant(half.size(), missing));
  EXPECT_TRUE(nothing.mean.isZero());
  EXPECT_TRUE(nothing.covariance.isIdentity());
}

TEST(TissueBelief, MeanAndDeviationAreThoseOfTheDepthsThemselves) {
  const Population people(400);
  const TissueModel model = build_tissue_model(people.depths, people.surface, two_modes()).value();
  const Belief population = population_tissue(model);
  const Eigen::VectorXd mean = expected_tissue(model, population);
  const Eigen::VectorXd sd = tissue_sd_mm(model, population);
  for (Index v = 0; v < mean.size(); v += 13) {
    EXPECT_NEAR(mean[v] / model.mean_mm[v], 1.0, 0.06) << v;
    EXPECT_NEAR(sd[v] / model.sd_mm[v], 1.0, 0.25) << v;
  }
}

TEST(TissueModel, RefusesWhatCantBeDepths) {
  const Population people(6);
  const auto what = [&](const Eigen::MatrixXd& depths) {
    return build_tissue_model(depths, people.surface).error().what;
  };
  EXPECT_THAT(what(people.depths.leftCols(2)), ::testing::HasSubstr("at least 3 subjects"));
  EXPECT_THAT(what(people.depths.topRows(9)), ::testing::HasSubstr("9 vertices"));
  Eigen::MatrixXd negative = people.depths;
  negative(3, 2) = -1.0;
  EXPECT_THAT(what(negative), ::testing::HasSubstr("negative"));
  const Eigen::MatrixXd unseen =
      Eigen::MatrixXd::Constant(people.depths.rows(), people.depths.cols(), missing);
  EXPECT_THAT(what(unseen), ::testing::HasSubstr("no vertex"));
}

}  // namespace
}  // namespace skullstation
