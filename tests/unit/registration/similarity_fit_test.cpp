#include "reconstruction/registration/similarity_fit.h"

#include <gtest/gtest.h>

#include "core/random.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

Points3 random_points(int count, std::uint64_t seed) {
  Random random(seed);
  Points3 points(count, 3);
  for (int i = 0; i < count; ++i) {
    for (int c = 0; c < 3; ++c) points(i, c) = random.normal(0.0, 30.0);
  }
  return points;
}

Similarity3 some_similarity() {
  Similarity3 transform;
  transform.scale = 1.7;
  transform.rotation = Eigen::AngleAxisd(2.9, Vector3d(1, -2, 0.5).normalized());
  transform.translation = Vector3d(10, -200, 33);
  return transform;
}

Points3 moved(const Similarity3& transform, const Points3& points) {
  Points3 result(points.rows(), 3);
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    result.row(i) = transform * points.row(i).transpose();
  }
  return result;
}

TEST(SimilarityFit, RecoversAnExactTransform) {
  const Points3 source = random_points(20, 1);
  const Similarity3 truth = some_similarity();
  for (const FitScale scale : {FitScale::to_target, FitScale::symmetric}) {
    const auto fit = fit_similarity(source, moved(truth, source), {}, scale);
    ASSERT_TRUE(fit);
    EXPECT_TRUE(fit->matrix().isApprox(truth.matrix(), 1e-10));
  }
  Similarity3 rigid = truth;
  rigid.scale = 1.0;
  const auto fit = fit_similarity(source, moved(rigid, source), {}, FitScale::one);
  EXPECT_TRUE(fit->matrix().isApprox(rigid.matrix(), 1e-10));
}

TEST(SimilarityFit, ThreePointsAreEnough) {
  const Points3 source = random_points(3, 2);
  const auto fit =
      fit_similarity(source, moved(some_similarity(), source), {}, FitScale::to_target);
  ASSERT_TRUE(fit);
  EXPECT_TRUE(fit->matrix().isApprox(some_similarity().matrix(), 1e-9));
}

TEST(SimilarityFit, IsTheLeastSquaresOptimum) {
  const Points3 source = random_points(50, 3);
  const Points3 target = moved(some_similarity(), source) + 0.1 * random_points(50, 4);
  const auto squares = [&](const Similarity3& t) {
    return (moved(t, source) - target).squaredNorm();
  };
  const auto fit = fit_similarity(source, target, {}, FitScale::to_target);
  ASSERT_TRUE(fit);
  for (int direction = 0; direction < 7; ++direction) {
    for (const double step : {-1e-3, 1e-3}) {
      Similarity3 other = *fit;
      if (direction < 3) other.translation[direction] += step;
      if (direction == 6) other.scale *= 1.0 + step;
      if (direction >= 3 && direction < 6) {
        other.rotation = Eigen::AngleAxisd(step, Vector3d::Unit(direction - 3)) * other.rotation;
      }
      EXPECT_GT(squares(other), squares(*fit));
    }
  }
}

TEST(SimilarityFit, TheSymmetricFitOfTheSwappedPointsIsTheInverse) {
  const Points3 source = random_points(50, 5);
  const Points3 target = moved(some_similarity(), source) + 0.2 * random_points(50, 6);
  const auto there = fit_similarity(source, target, {}, FitScale::symmetric);
  const auto back = fit_similarity(target, source, {}, FitScale::symmetric);
  EXPECT_TRUE(there->inverse().matrix().isApprox(back->matrix(), 1e-9));
}

TEST(SimilarityFit, PointsWithoutWeightDoNotCount) {
  const Points3 source = random_points(20, 7);
  Points3 target = moved(some_similarity(), source);
  target.row(4).array() += 1000.0;
  Eigen::VectorXd weights = Eigen::VectorXd::Ones(20);
  weights[4] = 0.0;
  const auto fit = fit_similarity(source, target, weights, FitScale::to_target);
  EXPECT_TRUE(fit->matrix().isApprox(some_similarity().matrix(), 1e-9));
}

TEST(SimilarityFit, NeverReflects) {
  const Points3 source = random_points(30, 8);
  Points3 mirrored = source;
  mirrored.col(0) *= -1.0;
  const auto fit = fit_similarity(source, mirrored, {}, FitScale::one);
  ASSERT_TRUE(fit);
  EXPECT_NEAR(fit->rotation.toRotationMatrix().determinant(), 1.0, 1e-12);
}

TEST(SimilarityFit, TooFewPointsOrALineAreErrors) {
  const Points3 two = random_points(2, 9);
  EXPECT_EQ(fit_similarity(two, two, {}, FitScale::one).error().kind, ErrorKind::no_result);
  Points3 line(10, 3);
  for (int i = 0; i < 10; ++i) line.row(i) << i, 2 * i, -i;
  EXPECT_EQ(fit_similarity(line, line, {}, FitScale::one).error().kind, ErrorKind::no_result);
  EXPECT_EQ(
      fit_similarity(Points3::Ones(5, 3), Points3::Ones(5, 3), {}, FitScale::one).error().kind,
      ErrorKind::no_result);
}

}  // namespace
}  // namespace skullstation
