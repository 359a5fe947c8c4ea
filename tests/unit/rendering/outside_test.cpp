#include "reconstruction/rendering/outside.h"

#include <gtest/gtest.h>

#include <array>

#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using testing::sphere;

TriangleMesh joined(const TriangleMesh& a, const TriangleMesh& b) {
  TriangleMesh both;
  both.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  both.vertices << a.vertices, b.vertices;
  both.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  both.triangles << a.triangles, b.triangles.array() + static_cast<int>(a.vertices.rows());
  both.normals = vertex_normals(both);
  return both;
}

/// A hollow ball: the outer sphere's vertices come first.
TriangleMesh hollow_ball() {
  TriangleMesh inner = sphere(18.0, 3);
  inner.triangles.col(1).swap(inner.triangles.col(2));
  return joined(sphere(20.0, 3), inner);
}

TEST(Outside, OfAHollowBallIsItsOuterSphere) {
  const TriangleMesh ball = hollow_ball();
  const std::vector<bool> outside = outside_vertices(ball, 2);
  ASSERT_EQ(outside.size(), static_cast<std::size_t>(ball.vertices.rows()));
  for (std::size_t v = 0; v < outside.size(); ++v) {
    EXPECT_EQ(outside[v], v < outside.size() / 2) << v;
  }
}

TEST(Outside, OfSomeVerticesAloneInTheirOrder) {
  const TriangleMesh ball = hollow_ball();
  const int half = static_cast<int>(ball.vertices.rows()) / 2;
  const std::array some{half, 0, half + 7, 7};
  EXPECT_EQ(outside_vertices(ball, some, 100, 1), (std::vector<bool>{false, true, false, true}));
}

}  // namespace
}  // namespace skullstation
