#include "reconstruction/mesh/decimation.h"

#include <gtest/gtest.h>

#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/volume/isosurface.h"
#include "tests/unit/volume/analytic_volumes.h"

namespace skullstation {
namespace {

using skullstation::testing::grid_of;
using skullstation::testing::sampled;

TriangleMesh sphere_surface() {
  const Volume volume = sampled(grid_of({101, 101, 101}, {0.5, 0.5, 0.5}), [](const auto& p) {
    return 200.0 * std::clamp(20.0 - p.norm(), -8.0, 8.0);
  });
  return isosurface(volume.grid, volume.hu, 0.0, 2);
}

std::vector<double> edge_lengths(const TriangleMesh& mesh) {
  std::vector<double> lengths;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int side = 0; side < 3; ++side) {
      lengths.push_back((mesh.vertices.row(mesh.triangles(f, side)) -
                         mesh.vertices.row(mesh.triangles(f, (side + 1) % 3)))
                            .norm());
    }
  }
  return lengths;
}

TEST(Decimation, ASphereKeepsItsShapeWithUniformEdges) {
  for (const double edge_mm : {1.0, 2.0}) {
    const TriangleMesh mesh = decimated(sphere_surface(), {edge_mm, 0.5});
    const MeshTopology topology = topology_of(mesh);
    EXPECT_TRUE(topology.is_closed_manifold());
    EXPECT_EQ(topology.euler_characteristic, 2);
    double mean = 0.0;
    double longest = 0.0;
    const auto lengths = edge_lengths(mesh);
    for (const double length : lengths) {
      mean += length / static_cast<double>(lengths.size());
      longest = std::max(longest, length);
    }
    EXPECT_NEAR(mean / edge_mm, 1.0, 0.1);
    EXPECT_LT(longest, 1.8 * edge_mm);
    const Eigen::VectorXd radii = mesh.vertices.rowwise().norm();
    EXPECT_LT((radii.array() - 20.0).abs().mean(), 0.02 * edge_mm * edge_mm);
    EXPECT_LT((radii.array() - 20.0).abs().maxCoeff(), 0.1 * edge_mm * edge_mm);
  }
}

TEST(Decimation, ReliefFinerThanTheErrorAllowsIsKept) {
  // A ball with a ridge 1.5 mm high: a coarse mesh may not flatten it.
  const Volume volume = sampled(grid_of({101, 101, 101}, {0.5, 0.5, 0.5}), [](const auto& p) {
    const double ridge = 1.5 * std::exp(-p.z() * p.z() / 0.5);
    return 200.0 * std::clamp(20.0 + ridge - p.norm(), -8.0, 8.0);
  });
  const TriangleMesh fine = isosurface(volume.grid, volume.hu, 0.0, 2);
  const TriangleMesh coarse = decimated(fine, {4.0, 0.15});
  EXPECT_GT(coarse.vertices.rowwise().norm().maxCoeff(), 21.2);
  EXPECT_TRUE(topology_of(coarse).is_closed_manifold());
  EXPECT_LT(coarse.vertices.rows(), fine.vertices.rows() / 10);
}

TEST(Decimation, ABoundaryStaysWhereItIs) {
  const TriangleMesh closed = sphere_surface();
  const TriangleMesh open = submesh(
      closed, [&](Eigen::Index f) { return closed.vertices(closed.triangles(f, 0), 2) > 0.0; });
  const auto before = topology_of(open).boundary_edges;
  EXPECT_EQ(topology_of(decimated(open, {2.0, 0.15})).boundary_edges, before);
}

TEST(Decimation, TwoThinSheetsAreNotTornOrJoined) {
  // A shell one millimetre thick: 0.5 mm voxels, both sides decimated to 3 mm.
  const Volume volume = sampled(grid_of({101, 101, 101}, {0.5, 0.5, 0.5}), [](const auto& p) {
    return 400.0 * std::clamp(0.5 - std::abs(p.norm() - 20.0), -4.0, 4.0);
  });
  const TriangleMesh mesh = decimated(isosurface(volume.grid, volume.hu, 0.0, 2), {3.0, 0.15});
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.components, 2);
  EXPECT_EQ(topology.euler_characteristic, 4);
}

TEST(Decimation, BadOptionsAndAnEmptyMesh) {
  EXPECT_FALSE((DecimationOptions{0.0, 0.1}.validate()));
  EXPECT_FALSE((DecimationOptions{1.0, 0.0}.validate()));
  EXPECT_TRUE(DecimationOptions{}.validate());
  EXPECT_EQ(decimated(TriangleMesh{}, {}).triangles.rows(), 0);
}

}  // namespace
}  // namespace skullstation
