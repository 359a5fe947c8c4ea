#include "reconstruction/approximation/sphere_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "reconstruction/mesh/mesh_topology.h"
#include "tests/unit/statistics/test_surfaces.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

TEST(SphereModel, SpheresOnABallMakeALargerBall) {
  const TriangleMesh bone = testing::sphere(60.0, 60, 120);
  const TriangleMesh model =
      sphere_model(bone.vertices, VectorXd::Constant(bone.vertices.rows(), 7.0)).value();
  EXPECT_TRUE(topology_of(model).is_closed_manifold());
  EXPECT_EQ(topology_of(model).components, 1);
  // Between spheres 3 mm apart lie valleys a third of a millimetre deep.
  const Eigen::VectorXd radii = model.vertices.rowwise().norm();
  EXPECT_LT(radii.maxCoeff(), 67.01);
  EXPECT_GT(radii.minCoeff(), 66.6);
  EXPECT_NEAR(radii.mean(), 66.9, 0.1);
  EXPECT_GT(model.normals.row(0).dot(model.vertices.row(0)), 60.0);
}

TEST(SphereModel, IsPartialWhereDepthsAreMissing) {
  const TriangleMesh bone = testing::sphere(60.0, 40, 80);
  VectorXd depths = VectorXd::Constant(bone.vertices.rows(), 7.0);
  for (Index v = 0; v < depths.size(); ++v) {
    if (bone.vertices(v, 2) > 30.0) depths[v] = std::numeric_limits<double>::quiet_NaN();
  }
  const TriangleMesh model = sphere_model(bone.vertices, depths).value();
  EXPECT_TRUE(topology_of(model).is_closed_manifold());
  EXPECT_LT(model.vertices.col(2).maxCoeff(), 38.0);
}

TEST(SphereModel, HasNoHollowsInside) {
  // A closed shell of spheres: the hollow within is no surface of a face.
  const TriangleMesh bone = testing::sphere(40.0, 40, 80);
  const TriangleMesh model =
      sphere_model(bone.vertices, VectorXd::Constant(bone.vertices.rows(), 5.0)).value();
  EXPECT_EQ(topology_of(model).components, 1);
  EXPECT_GT(model.vertices.rowwise().norm().minCoeff(), 44.0);
}

TEST(SphereModel, OwnDepthsTouchTheSkinAndStayInside) {
  // Skin: an ellipsoid. The closest distance of each bone vertex is found by brute force.
  const TriangleMesh bone = testing::sphere(50.0, 30, 60);
  TriangleMesh skin = testing::sphere(1.0, 150, 300);
  for (Index v = 0; v < skin.vertices.rows(); ++v) {
    skin.vertices.row(v) = skin.vertices.row(v).cwiseProduct(Eigen::RowVector3d(56.0, 62.0, 58.0));
  }
  VectorXd depths(bone.vertices.rows());
  for (Index v = 0; v < depths.size(); ++v) {
    depths[v] = (skin.vertices.rowwise() - bone.vertices.row(v)).rowwise().norm().minCoeff();
  }
  SphereModelOptions options;
  options.grid_mm = 0.5;
  const TriangleMesh model = sphere_model(bone.vertices, depths, options).value();
  double outside = 0.0;
  double nearest_sum = 0.0;
  for (Index v = 0; v < model.vertices.rows(); ++v) {
    const Eigen::Vector3d x(model.vertices(v, 0) / 56.0, model.vertices(v, 1) / 62.0,
                            model.vertices(v, 2) / 58.0);
    outside = std::max(outside, (x.norm() - 1.0) * 56.0);
    nearest_sum += std::abs(x.norm() - 1.0) * 56.0;
  }
  EXPECT_LT(outside, 0.1);
  EXPECT_LT(nearest_sum / static_cast<double>(model.vertices.rows()), 0.4);
}

TEST(SphereModel, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh bone = testing::sphere(30.0, 12, 20);
  const auto run = [&](int threads) {
    SphereModelOptions options;
    options.threads = threads;
    return sphere_model(bone.vertices, VectorXd::Constant(bone.vertices.rows(), 9.0), options)
        .value();
  };
  EXPECT_EQ(run(1).vertices, run(3).vertices);
}

TEST(SphereModel, RefusesWhatMakesNoSpheres) {
  const TriangleMesh bone = testing::sphere(30.0, 6, 8);
  const Index count = bone.vertices.rows();
  const auto what = [&](const VectorXd& depths, double grid_mm) {
    SphereModelOptions options;
    options.grid_mm = grid_mm;
    return sphere_model(bone.vertices, depths, options).error().what;
  };
  EXPECT_THAT(what(VectorXd::Constant(count, std::nan("")), 1.0),
              ::testing::HasSubstr("no vertex has a depth"));
  EXPECT_THAT(what(VectorXd::Ones(3), 1.0), ::testing::HasSubstr("3 depths"));
  EXPECT_THAT(what(VectorXd::Ones(count), 0.05), ::testing::HasSubstr("too many"));
  EXPECT_THAT(what(VectorXd::Ones(count), 0.0), ::testing::HasSubstr("positive"));
}

TEST(SmoothedDepths, TakeNoiseAwayAndKeepTheMean) {
  const TriangleMesh surface = testing::sphere(80.0, 60, 120);
  VectorXd depths(surface.vertices.rows());
  for (Index v = 0; v < depths.size(); ++v) {
    depths[v] = 10.0 + surface.vertices(v, 2) / 20.0 + (v % 2 == 0 ? 2.0 : -2.0);
  }
  depths[700] = std::nan("");
  const VectorXd smooth = smoothed_depths(surface, depths, 3.0);
  EXPECT_TRUE(std::isnan(smooth[700]));
  double greatest = 0.0;
  for (Index v = 0; v < depths.size(); ++v) {
    // The rings near the poles lie so close that their noise is not that of one edge.
    if (std::isnan(smooth[v]) || std::abs(surface.vertices(v, 2)) > 60.0) continue;
    greatest = std::max(greatest, std::abs(smooth[v] - 10.0 - surface.vertices(v, 2) / 20.0));
  }
  EXPECT_LT(greatest, 0.6);
  EXPECT_EQ(smoothed_depths(surface, depths.head(3), 0.0), depths.head(3));
}

}  // namespace
}  // namespace skullstation
