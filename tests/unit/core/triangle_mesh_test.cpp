#include "core/triangle_mesh.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skullstation {
namespace {

/// Corner of a cube of edge 2 at the origin: three faces seen from outside (from -x, -y, -z).
TriangleMesh tetrahedron() {
  TriangleMesh mesh;
  mesh.vertices.resize(4, 3);
  mesh.vertices << 0, 0, 0, 2, 0, 0, 0, 2, 0, 0, 0, 2;
  mesh.triangles.resize(4, 3);
  mesh.triangles << 0, 2, 1, 0, 1, 3, 1, 2, 3, 0, 3, 2;
  return mesh;
}

TEST(TriangleMesh, AreaOfATetrahedron) {
  EXPECT_NEAR(surface_area(tetrahedron()), 3 * 2.0 + std::sqrt(3.0) / 4.0 * 8.0, 1e-12);
}

TEST(TriangleMesh, VerticesShareTheirTrianglesAreas) {
  const Eigen::VectorXd areas = vertex_areas(tetrahedron());
  // The corner has a third of each of the three small sides.
  EXPECT_NEAR(areas[0], 2.0, 1e-12);
  EXPECT_NEAR(areas.sum(), surface_area(tetrahedron()), 1e-12);
}

TEST(TriangleMesh, NormalsPointOutwards) {
  const Points3 normals = vertex_normals(tetrahedron());
  const Eigen::RowVector3d corner = Eigen::RowVector3d(-1, -1, -1).normalized();
  EXPECT_LT((normals.row(0) - corner).norm(), 1e-12);
  for (int v = 0; v < 4; ++v) EXPECT_NEAR(normals.row(v).norm(), 1.0, 1e-12);
}

TEST(TriangleMesh, TheBoxHoldsEveryVertex) {
  const Eigen::AlignedBox3d box = bounding_box(tetrahedron());
  EXPECT_EQ(box.min(), Eigen::Vector3d(0, 0, 0));
  EXPECT_EQ(box.max(), Eigen::Vector3d(2, 2, 2));
  EXPECT_TRUE(bounding_box(TriangleMesh{}).isEmpty());
}

}  // namespace
}  // namespace skullstation
