#include "reconstruction/mesh/cube_cases.h"

#include <gtest/gtest.h>

#include <map>

namespace skullstation {
namespace {

class EveryCubeCase : public ::testing::TestWithParam<DiagonalCorners> {};

TEST_P(EveryCubeCase, PartsItsCornersAlongTheCrossedEdges) {
  for (int corners = 0; corners < 256; ++corners) {
    std::array<int, 12> uses{};
    for (const std::array<int, 3>& triangle : cube_cases(GetParam())[corners]) {
      for (const int edge : triangle) ++uses[edge];
    }
    for (std::size_t e = 0; e < 12; ++e) {
      const bool crossed =
          (corners >> cube_edges[e].corner & 1) != (corners >> cube_edges[e].far_corner() & 1);
      EXPECT_EQ(uses[e] > 0, crossed) << corners << " edge " << e;
    }
  }
}

TEST_P(EveryCubeCase, HasASurfaceThatEndsOnTheFacesOnly) {
  const auto on_one_face = [](int a, int b) {
    for (int axis = 0; axis < 3; ++axis) {
      for (int side = 0; side < 2; ++side) {
        const auto on_face = [&](int edge) {
          const CubeEdge& e = cube_edges[edge];
          return (e.corner >> axis & 1) == side && (e.far_corner() >> axis & 1) == side;
        };
        if (on_face(a) && on_face(b)) return true;
      }
    }
    return false;
  };
  for (int corners = 0; corners < 256; ++corners) {
    std::map<std::pair<int, int>, int> sides;  // each is run through once in either direction
    for (const std::array<int, 3>& triangle : cube_cases(GetParam())[corners]) {
      for (int k = 0; k < 3; ++k) ++sides[{triangle[k], triangle[(k + 1) % 3]}];
    }
    for (const auto& [side, count] : sides) {
      EXPECT_EQ(count, 1) << corners;
      const bool inner = sides.contains({side.second, side.first});
      EXPECT_NE(inner, on_one_face(side.first, side.second)) << corners;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Both, EveryCubeCase,
                         ::testing::Values(DiagonalCorners::stay_apart,
                                           DiagonalCorners::are_joined));

TEST(CubeCases, DiagonalCornersStayApartOrAreJoined) {
  constexpr int across_a_face = 0b0000'1001;  // corners 0 and 3
  const auto count = [&](DiagonalCorners inside) {
    return cube_cases(inside)[across_a_face].size();
  };
  EXPECT_EQ(count(DiagonalCorners::stay_apart), 2U);  // a triangle round each
  EXPECT_EQ(count(DiagonalCorners::are_joined), 4U);  // a hexagon round both
}

TEST(CubeCases, TrianglesFaceOutwards) {
  const CubeTriangles& one = cube_cases(DiagonalCorners::stay_apart)[1];  // corner 0 alone
  ASSERT_EQ(one.size(), 1U);
  // The crossed edges run along x, y and z; counter-clockwise seen from (1, 1, 1) is that order.
  std::array<int, 3> axes{};
  for (int k = 0; k < 3; ++k) axes[k] = cube_edges[one[0][k]].axis;
  while (axes[0] != 0) std::rotate(axes.begin(), axes.begin() + 1, axes.end());
  EXPECT_EQ(axes, (std::array<int, 3>{0, 1, 2}));
}

}  // namespace
}  // namespace skullstation
