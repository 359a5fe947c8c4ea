#include "reconstruction/mesh/hole_filling.h"

#include <gtest/gtest.h>

#include "reconstruction/mesh/mesh_topology.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

constexpr double kRadius_mm = 20.0;

/// A ball without what `is_missing` names of it, by the triangles' middles.
template <class IsMissing>
TriangleMesh ball_without(const IsMissing& is_missing) {
  const TriangleMesh ball = testing::sphere(kRadius_mm, 4);
  return submesh(ball, [&](Eigen::Index f) {
    const Eigen::RowVector3d middle =
        (ball.vertices.row(ball.triangles(f, 0)) + ball.vertices.row(ball.triangles(f, 1)) +
         ball.vertices.row(ball.triangles(f, 2))) /
        3.0;
    return !is_missing(middle.transpose());
  });
}

bool near_pole(const Eigen::Vector3d& point) { return point.z() > 0.9 * kRadius_mm; }

TEST(HoleFilling, ClosesABallAsItsRimBends) {
  const TriangleMesh open = ball_without(near_pole);
  ASSERT_GT(topology_of(open).boundary_edges, 0U);
  const FilledSurface filled = fill_holes(open, 100.0);
  EXPECT_EQ(filled.holes_filled, 1);
  EXPECT_EQ(filled.holes_left, 0);
  EXPECT_TRUE(topology_of(filled.mesh).is_closed_manifold());
  EXPECT_EQ(topology_of(filled.mesh).euler_characteristic, 2);
  // The cap beyond 0.9 of the radius: 2 pi r^2 0.1.
  EXPECT_NEAR(filled.filled_mm2, 0.2 * 3.14159 * kRadius_mm * kRadius_mm, 25.0);
  EXPECT_EQ(filled.mesh.vertices.topRows(open.vertices.rows()), open.vertices);
  EXPECT_EQ(filled.mesh.triangles.topRows(open.triangles.rows()), open.triangles);
  int added = 0;
  for (std::size_t v = 0; v < filled.origin.size(); ++v) {
    if (filled.origin[v] >= 0) continue;
    ++added;
    // A flat lid would lie up to 2 mm below.
    EXPECT_NEAR(filled.mesh.vertices.row(static_cast<Eigen::Index>(v)).norm(), kRadius_mm, 1.0);
  }
  EXPECT_GT(added, 10);
}

TEST(HoleFilling, LeavesOpenWhatIsTooLarge) {
  const TriangleMesh open = ball_without([](const Eigen::Vector3d& point) {
    return near_pole(point) || point.z() < -0.3 * kRadius_mm;
  });
  const FilledSurface filled = fill_holes(open, 80.0);  // rims of about 55 and 120 mm
  EXPECT_EQ(filled.holes_filled, 1);
  EXPECT_EQ(filled.holes_left, 1);
  const TriangleMesh untouched = fill_holes(open, 10.0).mesh;
  EXPECT_EQ(untouched.vertices, open.vertices);
  EXPECT_EQ(untouched.triangles, open.triangles);
}

TEST(HoleFilling, TakesApartWhereAnOpeningPinchesTheSurface) {
  // Two missing triangles that touch in a vertex make one rim that runs through it twice.
  const TriangleMesh ball = testing::sphere(kRadius_mm, 3);
  const int pinched = ball.triangles(0, 0);
  std::vector<Eigen::Index> around;
  for (Eigen::Index f = 0; f < ball.triangles.rows(); ++f) {
    if ((ball.triangles.row(f).array() == pinched).any()) around.push_back(f);
  }
  const auto neighbours = [&](Eigen::Index a, Eigen::Index b) {
    int shared = 0;
    for (int i = 0; i < 3; ++i)
      shared += (ball.triangles.row(b).array() == ball.triangles(a, i)).any();
    return shared == 2;
  };
  Eigen::Index other = -1;
  for (const Eigen::Index f : around) {
    if (f != around[0] && !neighbours(around[0], f)) other = f;
  }
  ASSERT_GE(other, 0);
  const TriangleMesh open =
      submesh(ball, [&](Eigen::Index f) { return f != around[0] && f != other; });
  const FilledSurface filled = fill_holes(open, 100.0);
  EXPECT_EQ(topology_of(filled.mesh).boundary_edges, 0U);
  EXPECT_EQ(topology_of(filled.mesh).nonmanifold_edges, 0U);
  EXPECT_EQ(topology_of(filled.mesh).nonmanifold_vertices, 0U);
  for (std::size_t v = 0; v < filled.origin.size(); ++v) {
    if (filled.origin[v] < 0) continue;
    EXPECT_EQ(filled.mesh.vertices.row(static_cast<Eigen::Index>(v)),
              open.vertices.row(filled.origin[v]));
  }
}

}  // namespace
}  // namespace skullstation
