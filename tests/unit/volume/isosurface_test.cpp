#include "reconstruction/volume/isosurface.h"

#include <gtest/gtest.h>

#include <numbers>

#include "core/random.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;
using skullstation::testing::sampled;

TriangleMesh surface_of(const Volume& volume, double iso_hu, int threads = 2) {
  return isosurface(volume.grid, volume.hu, iso_hu, threads);
}

/// A ball with a border as soft as a scanner makes it: 100 HU/voxel at the surface.
Volume ball(const VoxelGrid& grid, double radius_mm, const Eigen::Vector3d& center_mm) {
  return sampled(grid, [&](const Eigen::Vector3d& p) {
    return 100.0 * std::clamp(radius_mm - (p - center_mm).norm(), -8.0, 8.0);
  });
}

TEST(Isosurface, ASphereIsFoundToAFiftiethOfAVoxel) {
  const Volume volume = ball(grid_of({61, 61, 61}, {1, 1, 1}), 20.0, {0.3, -0.2, 0.1});
  const TriangleMesh mesh = surface_of(volume, 0.0);
  double sum = 0.0;
  double largest = 0.0;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const double error = std::abs(
        (mesh.vertices.row(v).transpose() - Eigen::Vector3d(0.3, -0.2, 0.1)).norm() - 20.0);
    sum += error;
    largest = std::max(largest, error);
  }
  EXPECT_LT(sum / static_cast<double>(mesh.vertices.rows()), 0.01);
  EXPECT_LT(largest, 0.05);
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.euler_characteristic, 2);
  const double ball_volume = 4.0 / 3.0 * std::numbers::pi * 20.0 * 20.0 * 20.0;
  EXPECT_NEAR(enclosed_volume(mesh) / ball_volume, 1.0, 2e-3) << "positive: oriented outwards";
}

TEST(Isosurface, ObliqueAnisotropicAndLeftHandedGridsGiveTheSameSphere) {
  for (const bool left_handed : {false, true}) {
    VoxelGrid grid = grid_of({80, 70, 40}, {0.7, 0.8, 1.5}, 35.0);
    if (left_handed) {
      grid.origin_mm = grid.patient_from_voxel({79, 0, 0});
      grid.direction.col(0) *= -1.0;
    }
    const TriangleMesh mesh = surface_of(ball(grid, 20.0, {1, 2, 3}), 0.0);
    const Eigen::RowVector3d center(1, 2, 3);
    const Eigen::VectorXd radii = (mesh.vertices.rowwise() - center).rowwise().norm();
    EXPECT_LT((radii.array() - 20.0).abs().mean(), 0.02);
    EXPECT_GT(enclosed_volume(mesh), 0.0);
    EXPECT_TRUE(topology_of(mesh).is_closed_manifold());
  }
}

TEST(Isosurface, NoiseOfEveryKindGivesAClosedManifold) {
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    Volume volume;
    volume.grid = grid_of({17, 13, 37}, {1, 1, 1});
    Random random(seed);
    const double share = 0.1 + 0.04 * static_cast<double>(seed);
    for (std::size_t i = 0; i < volume.grid.count(); ++i) {
      volume.hu.push_back(random.uniform() < share ? 100 : -100);
    }
    const MeshTopology topology = topology_of(surface_of(volume, 0.0));
    EXPECT_TRUE(topology.is_closed_manifold())
        << seed << ": " << topology.boundary_edges << " " << topology.nonmanifold_edges << " "
        << topology.nonmanifold_vertices;
  }
}

TEST(Isosurface, ABodyCutByTheBorderGetsAFlatCap) {
  // The ball's centre lies on the lowest slice.
  const VoxelGrid grid = grid_of({61, 61, 41}, {1, 1, 1});
  const TriangleMesh mesh = surface_of(ball(grid, 15.0, {0, 0, -20}), 0.0);
  EXPECT_TRUE(topology_of(mesh).is_closed_manifold());
  EXPECT_NEAR(mesh.vertices.col(2).minCoeff(), -20.0, 0.05);
  const double half_ball = 2.0 / 3.0 * std::numbers::pi * 15.0 * 15.0 * 15.0;
  EXPECT_NEAR(enclosed_volume(mesh) / half_ball, 1.0, 0.01);
}

TEST(Isosurface, IsTheSameForAnyNumberOfThreads) {
  const Volume volume = ball(grid_of({40, 40, 50}, {1, 1, 1}), 15.0, {0, 0, 0});
  const TriangleMesh one = surface_of(volume, 0.0, 1);
  const TriangleMesh four = surface_of(volume, 0.0, 4);
  EXPECT_EQ(one.vertices, four.vertices);
  EXPECT_EQ(one.triangles, four.triangles);
}

TEST(Isosurface, AnEmptyFieldHasNoSurface) {
  Volume volume;
  volume.grid = grid_of({5, 5, 5}, {1, 1, 1});
  volume.hu.assign(volume.grid.count(), -1000);
  EXPECT_EQ(surface_of(volume, 0.0).triangles.rows(), 0);
}

}  // namespace
}  // namespace skullstation
