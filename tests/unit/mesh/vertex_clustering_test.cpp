#include "reconstruction/mesh/vertex_clustering.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {
namespace {

constexpr double radius_mm = 50.0;

/// A ball of 2 * rings^2 quadrangles, each cut in two.
TriangleMesh ball(int rings) {
  const int around = 2 * rings;
  TriangleMesh mesh;
  mesh.vertices.resize((rings + 1) * around, 3);
  mesh.triangles.resize(2 * rings * around, 3);
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j < around; ++j) {
      const double polar = std::numbers::pi * i / rings;
      const double turn = 2.0 * std::numbers::pi * j / around;
      mesh.vertices.row(i * around + j) << radius_mm * std::sin(polar) * std::cos(turn),
          radius_mm * std::sin(polar) * std::sin(turn), radius_mm * std::cos(polar);
    }
  }
  Eigen::Index t = 0;
  for (int i = 0; i < rings; ++i) {
    for (int j = 0; j < around; ++j) {
      const int a = i * around + j, b = i * around + (j + 1) % around;
      mesh.triangles.row(t++) << a, a + around, b + around;
      mesh.triangles.row(t++) << a, b + around, b;
    }
  }
  return mesh;
}

TEST(VertexClustering, ABallOfTooManyTrianglesKeepsItsShape) {
  constexpr Eigen::Index most = 20000;
  const TriangleMesh fine = ball(400);
  ASSERT_EQ(fine.triangles.rows(), 640000);
  const TriangleMesh coarse = thinned(fine, most);
  EXPECT_GT(coarse.triangles.rows(), most * 7 / 10);
  EXPECT_LT(coarse.triangles.rows(), most * 13 / 10);
  const Eigen::ArrayXd off_mm = coarse.vertices.rowwise().norm().array() - radius_mm;
  EXPECT_LT(off_mm.abs().maxCoeff(), 0.05);
  EXPECT_NEAR(surface_area(coarse) / surface_area(fine), 1.0, 0.01);
  EXPECT_NEAR(enclosed_volume(coarse) / enclosed_volume(fine), 1.0, 0.005);
  EXPECT_EQ(topology_of(coarse).boundary_edges, 0u);
}

TEST(VertexClustering, WhatIsSmallEnoughStaysAsItIs) {
  TriangleMesh mesh = ball(20);
  mesh.normals = vertex_normals(mesh);
  const TriangleMesh same = thinned(mesh, mesh.triangles.rows());
  EXPECT_EQ(same.vertices, mesh.vertices);
  EXPECT_EQ(same.triangles, mesh.triangles);
  EXPECT_EQ(same.normals, mesh.normals);
}

TEST(VertexClustering, AVertexFarAwayDoesNotOverflowTheCells) {
  TriangleMesh mesh = ball(20);
  mesh.vertices.row(0) << 1e12, 0.0, 0.0;
  const TriangleMesh coarse = clustered(mesh, 0.001);
  EXPECT_EQ(coarse.vertices.rows(), 2);
  EXPECT_EQ(coarse.vertices.maxCoeff(), 1e12);
  EXPECT_EQ(coarse.triangles.rows(), 0);
}

TEST(VertexClustering, AMeshWithoutAreaOrVerticesIsLeftToOthers) {
  EXPECT_EQ(clustered({}, 1.0).vertices.rows(), 0);
  TriangleMesh flat = ball(4);
  flat.vertices.setZero();
  EXPECT_EQ(thinned(flat, 1).triangles.rows(), flat.triangles.rows());
}

}  // namespace
}  // namespace skullstation
