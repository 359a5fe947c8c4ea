#include "reconstruction/mesh/flat_cuts.h"

#include <gtest/gtest.h>

#include <numbers>

#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {
namespace {

/// A ball of 80 mm round, flat above `cut_mm` as a scan that ends there.
TriangleMesh ball(double cut_mm) {
  constexpr int rings = 120;
  constexpr int sectors = 200;
  TriangleMesh mesh;
  mesh.vertices.resize((rings - 1) * sectors + 2, 3);
  mesh.triangles.resize(2 * sectors * (rings - 1), 3);
  mesh.vertices.row(0) << 0, 0, cut_mm;
  mesh.vertices.row(1) << 0, 0, -80.0;
  const auto at = [&](int ring, int sector) { return 2 + (ring - 1) * sectors + sector % sectors; };
  Eigen::Index t = 0;
  for (int ring = 1; ring < rings; ++ring) {
    for (int sector = 0; sector < sectors; ++sector) {
      const double polar = std::numbers::pi * ring / rings;
      const double around = 2.0 * std::numbers::pi * sector / sectors;
      Eigen::Vector3d x =
          80.0 * Eigen::Vector3d(std::sin(polar) * std::cos(around),
                                 std::sin(polar) * std::sin(around), std::cos(polar));
      x.z() = std::min(x.z(), cut_mm);
      mesh.vertices.row(at(ring, sector)) = x;
      if (ring == 1) {
        mesh.triangles.row(t++) << 0, at(1, sector), at(1, sector + 1);
      } else {
        mesh.triangles.row(t++) << at(ring - 1, sector), at(ring, sector), at(ring, sector + 1);
        mesh.triangles.row(t++) << at(ring - 1, sector), at(ring, sector + 1),
            at(ring - 1, sector + 1);
      }
    }
  }
  for (int sector = 0; sector < sectors; ++sector) {
    mesh.triangles.row(t++) << 1, at(rings - 1, sector + 1), at(rings - 1, sector);
  }
  mesh.triangles.conservativeResize(t, 3);
  return mesh;
}

TEST(FlatCuts, ALidIsTakenOffAndLeavesARim) {
  const TriangleMesh closed = ball(60.0);
  EXPECT_EQ(topology_of(closed).boundary_edges, 0U);
  const TriangleMesh open = opened_at_flat_cuts(closed);
  EXPECT_GT(topology_of(open).boundary_edges, 100U);
  // Nothing is left within the rim, whose radius is that of the cut, and all else is.
  for (Eigen::Index v = 0; v < open.vertices.rows(); ++v) {
    if (open.vertices(v, 2) > 59.9) EXPECT_GT(open.vertices.row(v).head<2>().norm(), 48.0);
  }
  EXPECT_DOUBLE_EQ(open.vertices.col(2).minCoeff(), -80.0);
}

TEST(FlatCuts, ARoundBodyKeepsItsUtmostPoints) {
  const TriangleMesh round = ball(80.0);
  EXPECT_EQ(opened_at_flat_cuts(round).triangles, round.triangles);
  EXPECT_EQ(opened_at_flat_cuts({}).triangles.rows(), 0);
}

TEST(FlatCuts, ABoxStays) {
  TriangleMesh box;
  box.vertices.resize(8, 3);
  for (int v = 0; v < 8; ++v) box.vertices.row(v) << v % 2, v / 2 % 2, v / 4;
  box.vertices *= 150.0;
  box.triangles.resize(12, 3);
  box.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6,
      0, 6, 2, 1, 3, 7, 1, 7, 5;
  EXPECT_EQ(opened_at_flat_cuts(box).triangles, box.triangles);
}

}  // namespace
}  // namespace skullstation
