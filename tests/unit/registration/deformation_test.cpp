// The energies of both non-rigid registrations, on shapes whose answers are known.

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/random.h"
#include "reconstruction/registration/bending_energy.h"
#include "reconstruction/registration/deformation_solver.h"
#include "reconstruction/registration/no_inversion.h"
#include "reconstruction/registration/smoothness_energy.h"
#include "reconstruction/registration/volume_energy.h"

namespace skullstation {
namespace {

/// A bar of cubes of 10 mm, each cut into six tetrahedra.
SkullTemplate bar(int cubes) {
  SkullTemplate solid;
  const int layers = cubes + 1;
  solid.vertices.resize(4 * layers, 3);
  for (int x = 0; x < layers; ++x) {
    for (int c = 0; c < 4; ++c) {
      solid.vertices.row(4 * x + c) << 10.0 * x, 10.0 * (c % 2), 10.0 * (c / 2);
    }
  }
  constexpr int kSix[6][4] = {{0, 1, 3, 7}, {0, 3, 2, 7}, {0, 2, 6, 7},
                              {0, 6, 4, 7}, {0, 4, 5, 7}, {0, 5, 1, 7}};
  solid.tetrahedra.resize(6 * cubes, 4);
  for (int x = 0; x < cubes; ++x) {
    const auto corner = [&](int code) {  // bits: along x, y, z
      return 4 * (x + code % 2) + code / 2 % 2 + 2 * (code / 4);
    };
    for (int t = 0; t < 6; ++t) {
      for (int i = 0; i < 4; ++i) solid.tetrahedra(6 * x + t, i) = corner(kSix[t][i]);
    }
  }
  for (Eigen::Index t = 0; t < solid.tetrahedra.rows(); ++t) {
    const Tetrahedra one = solid.tetrahedra.row(t);
    if (signed_volumes(one, solid.vertices)[0] < 0.0) {
      std::swap(solid.tetrahedra(t, 0), solid.tetrahedra(t, 1));
    }
  }
  solid.boundary_count = static_cast<int>(solid.vertices.rows());
  return solid;
}

Points3 affine_of(const Points3& points) {
  Eigen::Matrix3d matrix;
  matrix << 1.1, 0.2, 0.0, -0.1, 0.9, 0.05, 0.0, 0.1, 1.2;
  Points3 result = points * matrix.transpose();
  result.rowwise() += Eigen::RowVector3d(3.0, -2.0, 7.0);
  return result;
}

double energy(const Eigen::SparseMatrix<double>& matrix, const Points3& u) {
  const Eigen::Matrix<double, Eigen::Dynamic, 3> columns = u;
  return (columns.transpose() * (matrix * columns)).trace();
}

TEST(SmoothnessEnergy, IsZeroForAffineDisplacementsOnly) {
  const SkullTemplate solid = bar(6);
  const auto matrix = smoothness_matrix(solid.tetrahedra, solid.vertices);
  EXPECT_NEAR(energy(matrix, affine_of(solid.vertices) - solid.vertices), 0.0, 1e-15);
  Points3 bent = Points3::Zero(solid.vertices.rows(), 3);
  bent.col(2) = 1e-3 * solid.vertices.col(0).array().square().matrix();
  EXPECT_GT(energy(matrix, bent), 1e-8);
}

TEST(SmoothnessEnergy, OfAParabolaDoesNotDependOnItsLength) {
  // Second derivative 2e-3 everywhere: the mean square is the same for any bar.
  const auto of_bar = [](int cubes) {
    const SkullTemplate solid = bar(cubes);
    Points3 bent = Points3::Zero(solid.vertices.rows(), 3);
    bent.col(2) = 1e-3 * solid.vertices.col(0).array().square().matrix();
    return energy(smoothness_matrix(solid.tetrahedra, solid.vertices), bent);
  };
  EXPECT_NEAR(of_bar(40) / of_bar(20), 1.0, 0.1);
}

TEST(DeformationSolver, CarriesWhatIsMissingAlongAffinely) {
  const SkullTemplate solid = bar(12);
  const Points3 truth = affine_of(solid.vertices) - solid.vertices;
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(solid.vertices.rows(), 1e-12);
  weights.head(24).setConstant(1.0 / 24.0);
  Points3 targets = Points3::Zero(solid.vertices.rows(), 3);
  targets.topRows(24) = truth.topRows(24);
  DeformationSolver solver(solid);
  solver.stiffen(1e4, 0.0, weights);
  const Points3 u = solver.solve({weights, targets, Points3::Zero(solid.vertices.rows(), 3), 1.0},
                                 Points3(0, 3), Points3::Zero(solid.vertices.rows(), 3));
  EXPECT_LT((u - truth).rowwise().norm().maxCoeff(), 0.05);
}

TEST(DeformationSolver, SolvesForOtherWeightsThanItsFactor) {
  const SkullTemplate solid = bar(12);
  Random random(3);
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(solid.vertices.rows(), 0.02);
  Points3 targets(solid.vertices.rows(), 3);
  for (Eigen::Index i = 0; i < targets.size(); ++i) targets.data()[i] = random.normal();
  const Points3 start = Points3::Zero(solid.vertices.rows(), 3);
  DeformationSolver solver(solid);
  solver.stiffen(100.0, 1.0, weights);
  for (Eigen::Index v = 0; v < weights.size(); v += 3) weights[v] = 0.0;
  const Points3 stale = solver.solve({weights, targets, start, 1.0}, Points3(0, 3), start);
  solver.stiffen(100.0, 1.0, weights);
  const Points3 fresh = solver.solve({weights, targets, start, 1.0}, Points3(0, 3), start);
  EXPECT_LT((stale - fresh).cwiseAbs().maxCoeff(), 0.02);
}

TEST(VolumeEnergy, NearestMatrixHasUnitDeterminantAndIsNearest) {
  Random random(5);
  for (int i = 0; i < 100; ++i) {
    Eigen::Matrix3d matrix;
    for (int k = 0; k < 9; ++k) matrix.data()[k] = random.normal(k % 4 == 0 ? 1.0 : 0.0, 0.3);
    const Eigen::Matrix3d nearest = nearest_of_unit_determinant(matrix);
    ASSERT_NEAR(nearest.determinant(), 1.0, 0.02) << matrix;
  }
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.7, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  EXPECT_LT((nearest_of_unit_determinant(turn) - turn).norm(), 1e-9);
  EXPECT_LT((nearest_of_unit_determinant(1.2 * turn) - turn).norm(), 1e-6);
}

TEST(VolumeEnergy, ThePapersTermKeepsVolumesThatTheTargetsWouldChange) {
  const SkullTemplate solid = bar(4);
  const Eigen::VectorXd rest = signed_volumes(solid.tetrahedra, solid.vertices);
  const Points3 targets = 0.1 * solid.vertices;  // a third more volume
  const Eigen::VectorXd weights = Eigen::VectorXd::Constant(solid.vertices.rows(), 1.0 / 20.0);
  const Points3 start = Points3::Zero(solid.vertices.rows(), 3);
  const auto change = [&](double regularization) {
    const Points3 u = solve_volume_energy(solid.tetrahedra, solid.vertices, weights, targets,
                                          regularization, start);
    return (signed_volumes(solid.tetrahedra, solid.vertices + u) - rest).cwiseAbs().mean() /
           rest.mean();
  };
  EXPECT_NEAR(change(0.0), 0.331, 1e-3);
  EXPECT_LT(change(1.0), 0.01);
}

TEST(NoInversion, StopsBeforeAnyTetrahedronTurnsOver) {
  const SkullTemplate solid = bar(8);
  const Eigen::VectorXd rest = signed_volumes(solid.tetrahedra, solid.vertices);
  Random random(7);
  Points3 to = solid.vertices;
  for (Eigen::Index i = 0; i < to.size(); ++i) to.data()[i] += random.normal(0.0, 12.0);
  ASSERT_LT(signed_volumes(solid.tetrahedra, to).minCoeff(), 0.0);
  const SafeStep step = step_without_inversion(solid.tetrahedra, rest, solid.vertices, to, 0.05);
  EXPECT_GE(step.least_share, 0.05);
  EXPECT_GT(step.held_vertices, 0);
  EXPECT_GT((step.vertices - solid.vertices).norm(), 1.0) << "it still moves";
}

TEST(NoInversion, LetsASoundStepPass) {
  const SkullTemplate solid = bar(8);
  const Eigen::VectorXd rest = signed_volumes(solid.tetrahedra, solid.vertices);
  const Points3 to = affine_of(solid.vertices);
  const SafeStep step = step_without_inversion(solid.tetrahedra, rest, solid.vertices, to, 0.05);
  EXPECT_EQ(step.vertices, to);
  EXPECT_EQ(step.held_vertices, 0);
}

/// A sheet of 10 x 10 squares of 5 mm on a cylinder of 40 mm radius.
std::pair<Points3, Triangles> curved_sheet() {
  Points3 points(121, 3);
  Triangles triangles(200, 3);
  for (int y = 0; y < 11; ++y) {
    for (int x = 0; x < 11; ++x) {
      const double angle = 5.0 * x / 40.0;
      points.row(11 * y + x) << 40.0 * std::sin(angle), 5.0 * y, 40.0 * std::cos(angle);
      if (x == 10 || y == 10) continue;
      const int a = 11 * y + x;
      triangles.row(2 * (10 * y + x)) << a, a + 1, a + 12;
      triangles.row(2 * (10 * y + x) + 1) << a, a + 12, a + 11;
    }
  }
  return {points, triangles};
}

TEST(BendingEnergy, IsZeroForFlatSheetsHoweverStretched) {
  auto [points, triangles] = curved_sheet();
  points.col(2).setZero();
  const auto flaps = edge_flaps(points, triangles);
  const auto matrix = bending_matrix(flaps, points.rows());
  Points3 stretched = 1.3 * points;
  EXPECT_NEAR(energy(matrix, stretched), 0.0, 1e-12);
  EXPECT_NEAR(energy(matrix, points), 0.0, 1e-12);
}

TEST(BendingEnergy, RigidMotionsOfTheRestCostNothing) {
  const auto [points, triangles] = curved_sheet();
  const auto flaps = edge_flaps(points, triangles);
  const auto matrix = bending_matrix(flaps, points.rows());
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  Points3 now = points * turn.transpose();
  now.rowwise() += Eigen::RowVector3d(10, 20, 30);
  // The gradient of the energy, B x - pull, vanishes there.
  const Eigen::Matrix<double, Eigen::Dynamic, 3> columns = now;
  const Points3 gradient = Points3(matrix * columns) - rotated_rest_pull(flaps, points, now, 2);
  EXPECT_LT(gradient.cwiseAbs().maxCoeff(), 1e-9);
  const Points3 unturned = rotated_rest_pull(flaps, points, points, 1);
  EXPECT_GT((Points3(matrix * columns) - unturned).cwiseAbs().maxCoeff(), 1e-6);
}

}  // namespace
}  // namespace skullstation
