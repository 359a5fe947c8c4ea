#include "reconstruction/statistics/shape_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/LU>
#include <Eigen/QR>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// A population with known modes.
struct Truth {
  VectorXd mean;
  Eigen::MatrixXd modes;  // orthonormal
  VectorXd sd;
};

Truth make_truth(Index vertices, VectorXd sd, std::uint64_t seed) {
  Random random(seed);
  Truth truth{VectorXd(3 * vertices), Eigen::MatrixXd(3 * vertices, sd.size()), std::move(sd)};
  for (double& x : truth.mean) x = random.uniform(-80.0, 80.0);
  for (Index k = 0; k < truth.modes.cols(); ++k) {
    for (double& x : truth.modes.col(k)) x = random.normal();
  }
  truth.modes = Eigen::HouseholderQR<Eigen::MatrixXd>(truth.modes).householderQ() *
                Eigen::MatrixXd::Identity(truth.modes.rows(), truth.modes.cols());
  return truth;
}

std::vector<Points3> members(const Truth& truth, int count, double noise_sd, std::uint64_t seed) {
  Random random(seed);
  std::vector<Points3> shapes;
  for (int i = 0; i < count; ++i) {
    VectorXd x = truth.mean;
    for (Index k = 0; k < truth.sd.size(); ++k) {
      x += random.normal() * truth.sd[k] * truth.modes.col(k);
    }
    for (double& value : x) value += noise_sd * random.normal();
    shapes.push_back(unflattened(x));
  }
  return shapes;
}

VectorXd ones(Index count) { return VectorXd::Ones(count); }

TEST(ShapeModel, FindsThePopulationsModesVariancesAndNoise) {
  const Truth truth = make_truth(200, VectorXd{{60.0, 30.0, 15.0}}, 1);
  const std::vector<Points3> shapes = members(truth, 400, 0.3, 2);
  const ShapeModel model = build_shape_model(shapes, ones(200), {1.0, 3}).value();
  ASSERT_EQ(model.mode_count(), 3);
  EXPECT_TRUE(model.validate());
  for (Index k = 0; k < 3; ++k) {
    EXPECT_GT(std::abs(model.modes.col(k).dot(truth.modes.col(k))), 0.98) << k;
    EXPECT_NEAR(std::sqrt(model.variances[k]) / truth.sd[k], 1.0, 0.1) << k;
  }
  EXPECT_NEAR(std::sqrt(model.noise_variance), 0.3, 0.01);
  EXPECT_LT((model.mean - truth.mean).norm() / std::sqrt(600.0), 0.3);
  const Eigen::MatrixXd gram = model.modes.transpose() * model.modes;
  EXPECT_TRUE(gram.isIdentity(1e-9));
}

TEST(ShapeModel, AllModesGiveEachShapeBack) {
  const Truth truth = make_truth(50, VectorXd{{20.0, 10.0, 5.0, 4.0}}, 3);
  const std::vector<Points3> shapes = members(truth, 9, 0.5, 4);
  const ShapeModel model = build_shape_model(shapes, ones(50), {1.0, 1000}).value();
  EXPECT_EQ(model.mode_count(), 8);
  for (const Points3& shape : shapes) {
    EXPECT_LT((shape_at(model, coefficients_of(model, shape)) - shape).cwiseAbs().maxCoeff(), 1e-9);
  }
}

TEST(ShapeModel, VerticesWithoutWeightGoAlongWithoutASay) {
  // Vertex 1 follows vertex 0; vertex 2 only makes noise, a hundred times as much.
  Random random(5);
  std::vector<Points3> shapes;
  for (int i = 0; i < 40; ++i) {
    const double a = random.normal();
    Points3 shape = Points3::Zero(3, 3);
    shape(0, 0) = a;
    shape(1, 1) = 2.0 * a;
    shape.row(2).setConstant(100.0 * random.normal());
    shapes.push_back(shape);
  }
  const ShapeModel model =
      build_shape_model(shapes, VectorXd{{1.0, 0.0, 0.0}}, {0.99, 1000}).value();
  ASSERT_EQ(model.mode_count(), 1);
  const Points3 shape = shape_at(model, VectorXd::Ones(1));
  const Points3 mean = unflattened(model.mean);
  EXPECT_NEAR((shape(1, 1) - mean(1, 1)) / (shape(0, 0) - mean(0, 0)), 2.0, 1e-9);
}

TEST(ShapeModel, KeepsAsManyModesAsTheVarianceAsksFor) {
  const Truth truth = make_truth(100, VectorXd{{50.0, 30.0, 20.0, 1.0}}, 6);
  const std::vector<Points3> shapes = members(truth, 60, 0.0, 7);
  EXPECT_EQ(build_shape_model(shapes, ones(100), {0.98, 1000})->mode_count(), 3);
  EXPECT_EQ(build_shape_model(shapes, ones(100), {0.98, 2})->mode_count(), 2);
}

TEST(ShapeModel, RefusesWhatIsNoPopulation) {
  const Truth truth = make_truth(10, VectorXd{{5.0}}, 8);
  std::vector<Points3> shapes = members(truth, 5, 0.1, 9);
  const auto what = [&](const VectorXd& weights) {
    return build_shape_model(shapes, weights).error().what;
  };
  EXPECT_THAT(what(ones(9)), ::testing::HasSubstr("one weight for each vertex"));
  EXPECT_THAT(what(VectorXd::Zero(10)), ::testing::HasSubstr("not all zero"));
  shapes[3](2, 1) = std::nan("");
  EXPECT_THAT(what(ones(10)), ::testing::HasSubstr("shape 3"));
  shapes[3] = Points3::Zero(11, 3);
  EXPECT_THAT(what(ones(10)), ::testing::HasSubstr("11 vertices"));
  shapes.resize(2);
  EXPECT_THAT(what(ones(10)), ::testing::HasSubstr("at least 3"));
  shapes = std::vector<Points3>(4, Points3::Ones(10, 3));
  EXPECT_THAT(what(ones(10)), ::testing::HasSubstr("the same"));
}

TEST(ShapeBelief, ExactObservationsOfAllVerticesGiveTheCoefficients) {
  const Truth truth = make_truth(60, VectorXd{{40.0, 20.0, 10.0}}, 10);
  ShapeModel model{truth.mean, truth.modes, truth.sd.cwiseAbs2(), 0.0};
  const VectorXd wanted{{1.2, -0.7, 0.4}};
  const Points3 shape = shape_at(model, wanted);
  std::vector<VertexObservation> observations;
  for (int v = 0; v < 60; ++v) {
    observations.push_back({v, shape.row(v), Eigen::Vector3d::Zero(), 0.01, 0.01});
  }
  const Belief belief = updated(model, population_belief(model), observations);
  EXPECT_LT((belief.mean - wanted).norm(), 1e-3);
  EXPECT_LT(vertex_sd_mm(model, belief).maxCoeff(), 0.02);
}

TEST(ShapeBelief, IsTheGaussianConditional) {
  const Truth truth = make_truth(8, VectorXd{{6.0, 3.0, 2.0}}, 11);
  const ShapeModel model{truth.mean, truth.modes, truth.sd.cwiseAbs2(), 0.04};
  Random random(12);
  // Three vertices seen, with different errors along and across a normal.
  std::vector<VertexObservation> seen;
  Eigen::MatrixXd rows(9, 3);
  VectorXd difference(9);
  Eigen::MatrixXd error = Eigen::MatrixXd::Zero(9, 9);
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d normal =
        Eigen::Vector3d(random.normal(), random.normal(), random.normal()).normalized();
    const Eigen::Vector3d position =
        truth.mean.segment<3>(6 * i) + Eigen::Vector3d(random.normal(), 1.0, random.normal());
    seen.push_back({2 * i, position, normal, 0.5, 3.0});
    rows.middleRows<3>(3 * i) = model.scaled_modes().middleRows<3>(6 * i);
    difference.segment<3>(3 * i) = position - truth.mean.segment<3>(6 * i);
    const Eigen::Matrix3d along = normal * normal.transpose();
    error.block<3, 3>(3 * i, 3 * i) =
        (0.25 + 0.04) * along + (9.0 + 0.04) * (Eigen::Matrix3d::Identity() - along);
  }
  // The textbook's form, over the observations rather than over the coefficients.
  const Eigen::MatrixXd gain = rows.transpose() * (rows * rows.transpose() + error).inverse();
  const Belief belief = updated(model, population_belief(model), seen);
  EXPECT_LT((belief.mean - gain * difference).norm(), 1e-9);
  const Eigen::MatrixXd covariance = Eigen::MatrixXd::Identity(3, 3) - gain * rows;
  EXPECT_LT((belief.covariance - covariance).norm(), 1e-9);
}

TEST(ShapeBelief, TikhonovsWeightIsNoise) {
  // METHOD: 6,000 points, 30 modes, 1e-4 is 0.14 mm.
  EXPECT_NEAR(tikhonov_noise_sd_mm(1e-4, 6000, 30), 0.1414, 1e-3);
  EXPECT_NEAR(tikhonov_noise_sd_mm(1e-3, 70000, 61), 1.071, 1e-3);
}

TEST(ShapeModel, ValidateNamesWhatIsWrong) {
  const Truth truth = make_truth(4, VectorXd{{2.0}}, 13);
  ShapeModel model{truth.mean, truth.modes, truth.sd.cwiseAbs2(), 0.0};
  ASSERT_TRUE(model.validate());
  model.variances[0] = 0.0;
  EXPECT_THAT(model.validate().error().what, ::testing::HasSubstr("no variance"));
  model.variances = VectorXd::Ones(2);
  EXPECT_THAT(model.validate().error().what, ::testing::HasSubstr("2 variances"));
}

}  // namespace
}  // namespace skullstation
