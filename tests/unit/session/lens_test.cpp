#include "core/session/lens.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "core/random.h"

namespace skullstation {
namespace {

Lens typical() {
  return Lens::from_params(1600, 1200, LensModel::opencv,
                           {2800.0, 2790.0, 807.3, 596.1, -0.18, 0.12, 0.0008, -0.0005});
}

TEST(Lens, ProjectsByTheFormulaOfTheOpencvModel) {
  const Lens lens = Lens::from_params(640, 480, LensModel::opencv,
                                      {500.0, 400.0, 320.0, 240.0, 0.1, 0.01, 0.002, 0.003});
  // x = 0.5, y = 0.25, r2 = 0.3125, worked by hand.
  const double radial = 1.0 + 0.1 * 0.3125 + 0.01 * 0.3125 * 0.3125;
  const double x = 0.5 * radial + 2.0 * 0.002 * 0.125 + 0.003 * (0.3125 + 0.5);
  const double y = 0.25 * radial + 0.002 * (0.3125 + 0.125) + 2.0 * 0.003 * 0.125;
  const Eigen::Vector2d px = lens.project({1.0, 0.5, 2.0});
  EXPECT_NEAR(px.x(), 500.0 * x + 320.0, 1e-12);
  EXPECT_NEAR(px.y(), 400.0 * y + 240.0, 1e-12);
}

TEST(Lens, DerivativeIsThatOfTheProjection) {
  const Lens lens = typical();
  const Eigen::Vector3d x(90.0, -60.0, 500.0);
  const Eigen::Matrix<double, 2, 3> derivative = lens.project_derivative(x);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d d = 1e-3 * Eigen::Vector3d::Unit(axis);
    const Eigen::Vector2d slope = (lens.project(x + d) - lens.project(x - d)) / 2e-3;
    EXPECT_LT((derivative.col(axis) - slope).norm(), 1e-6) << axis;
  }
}

TEST(Lens, PinholeHasNoDistortion) {
  const Lens lens = Lens::from_params(640, 480, LensModel::pinhole, {500.0, 400.0, 320.0, 240.0});
  EXPECT_TRUE(lens.project({0.2, -0.1, 2.0}).isApprox(Eigen::Vector2d(320.0 + 50.0, 240.0 - 20.0)));
  EXPECT_TRUE(lens.ray({370.0, 220.0})->isApprox(Eigen::Vector3d(0.1, -0.05, 1.0)));
  EXPECT_EQ(lens.params(LensModel::pinhole), (std::vector<double>{500.0, 400.0, 320.0, 240.0}));
}

TEST(Lens, RayUndoesProjectionOverTheWholeImage) {
  for (const double k1 : {-0.3, -0.05, 0.0, 0.2}) {
    for (const double p1 : {-0.002, 0.0, 0.003}) {
      Lens lens = typical();
      lens.k1 = k1;
      lens.p1 = p1;
      for (double y = 0.0; y <= 1200.0; y += 100.0) {
        for (double x = 0.0; x <= 1600.0; x += 100.0) {
          const auto ray = lens.ray({x, y});
          ASSERT_TRUE(ray) << x << " " << y;
          EXPECT_EQ(ray->z(), 1.0);
          EXPECT_LT((lens.project(*ray) - Eigen::Vector2d(x, y)).norm(), 1e-8);
        }
      }
    }
  }
}

TEST(Lens, ProjectionUndoesRayForWideLensUpToItsFold) {
  // 1 + 3 k1 s = 0 at s = 1 / 0.9: everything inside must come back as the same ray.
  Lens lens = Lens::from_params(1000, 1000, LensModel::opencv,
                                {500.0, 500.0, 500.0, 500.0, -0.3, 0.0, 0.0, 0.0});
  const double fold = std::sqrt(1.0 / 0.9);
  Random random(7);
  for (int i = 0; i < 500; ++i) {
    const double r = fold * 0.999 * std::sqrt(random.uniform());
    const double angle = random.uniform(0.0, 6.283185307179586);
    const Eigen::Vector3d x(r * std::cos(angle), r * std::sin(angle), 1.0);
    const auto ray = lens.ray(lens.project(x));
    ASSERT_TRUE(ray);
    EXPECT_LT((*ray - x).norm(), 1e-7);
  }
}

TEST(Lens, NoRayBeyondTheFold) {
  const Lens lens = Lens::from_params(1000, 1000, LensModel::opencv,
                                      {500.0, 500.0, 500.0, 500.0, -0.3, 0.0, 0.0, 0.0});
  const double fold = std::sqrt(1.0 / 0.9);
  const double farthest = fold * (1.0 - 0.3 * fold * fold);  // of all distorted radii
  EXPECT_TRUE(lens.ray({500.0 + 500.0 * (farthest - 1e-3), 500.0}));
  EXPECT_FALSE(lens.ray({500.0 + 500.0 * (farthest + 1e-3), 500.0}));
  EXPECT_FALSE(lens.ray({500.0, 500.0 - 500.0 * (farthest + 1.0)}));
}

TEST(Lens, NoRayBeyondTheFoldEvenWhereTheModelUnfoldsAgain) {
  // 1 - 3 s + 1.25 s^2: folds at s = 0.4, grows again from s = 2 on. The second branch reaches
  // every radius, yet no light ever took that way.
  const Lens lens = Lens::from_params(1000, 1000, LensModel::opencv,
                                      {500.0, 500.0, 500.0, 500.0, -1.0, 0.25, 0.0, 0.0});
  const double fold = std::sqrt(0.4);
  const double farthest = fold * (1.0 - 0.4 + 0.25 * 0.16);
  EXPECT_TRUE(lens.ray({500.0 + 500.0 * (farthest - 1e-3), 500.0}));
  EXPECT_FALSE(lens.ray({500.0 + 500.0 * (farthest + 1e-3), 500.0}));
}

TEST(Lens, PrincipalPointIsTheOpticalAxis) {
  EXPECT_TRUE(typical().ray({807.3, 596.1})->isApprox(Eigen::Vector3d::UnitZ(), 1e-12));
  EXPECT_TRUE(typical().project({0.0, 0.0, 5.0}).isApprox(Eigen::Vector2d(807.3, 596.1)));
}

TEST(Lens, ParametersKeepColmapsOrder) {
  const std::vector<double> params = {1, 2, 3, 4, 5, 6, 7, 8};
  const Lens lens = Lens::from_params(10, 20, LensModel::opencv, params);
  EXPECT_EQ(lens.width, 10);
  EXPECT_EQ(lens.height, 20);
  EXPECT_EQ(lens.params(LensModel::opencv), params);
}

TEST(Lens, WrongUseIsRefused) {
  EXPECT_THROW(Lens::from_params(1, 1, LensModel::opencv, {1, 2, 3, 4}), std::invalid_argument);
  EXPECT_THROW(Lens::from_params(1, 1, LensModel::pinhole, {1, 2, 3}), std::invalid_argument);
  EXPECT_THROW(typical().params(LensModel::pinhole), std::invalid_argument);
}

TEST(Lens, ModelNamesRoundTrip) {
  for (const LensModel model : {LensModel::pinhole, LensModel::opencv}) {
    EXPECT_EQ(lens_model_from_string(to_string(model)).value(), model);
  }
  EXPECT_EQ(parameter_count(LensModel::pinhole), 4);
  EXPECT_EQ(parameter_count(LensModel::opencv), 8);
  const auto unknown = lens_model_from_string("SIMPLE_RADIAL");
  ASSERT_FALSE(unknown);
  EXPECT_EQ(unknown.error().kind, ErrorKind::bad_input);
  EXPECT_NE(unknown.error().message().find("SIMPLE_RADIAL"), std::string::npos);
}

}  // namespace
}  // namespace skullstation
