#include "reconstruction/statistics/tissue_thickness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/unit/statistics/test_surfaces.h"

namespace skullstation {
namespace {

using skullstation::testing::sphere;

std::vector<bool> all(const TriangleMesh& mesh) {
  return std::vector<bool>(static_cast<std::size_t>(mesh.vertices.rows()), true);
}

TEST(TissueThickness, IsTheDistanceBetweenTheSurfaces) {
  const TriangleMesh skull = sphere(80.0, 12, 20);
  const Eigen::VectorXd thickness =
      tissue_thickness(skull, all(skull), sphere(86.0, 200, 400)).value();
  ASSERT_EQ(thickness.size(), skull.vertices.rows());
  // The skin's facets lie up to 0.01 mm inside the sphere.
  EXPECT_GT(thickness.minCoeff(), 5.98);
  EXPECT_LE(thickness.maxCoeff(), 6.0 + 1e-9);
}

TEST(TissueThickness, IsNotKnownWhereNothingWasSeenOrTheSkinEnds) {
  const TriangleMesh skull = sphere(80.0, 12, 20);
  TriangleMesh skin = sphere(86.0, 60, 120);
  // The skin ends at the equator.
  Triangles upper(skin.triangles.rows(), 3);
  Eigen::Index kept = 0;
  for (Eigen::Index t = 0; t < skin.triangles.rows(); ++t) {
    if (skin.vertices(skin.triangles.row(t), 2).minCoeff() > -1e-9) {
      upper.row(kept++) = skin.triangles.row(t);
    }
  }
  skin.triangles = upper.topRows(kept);
  std::vector<bool> measurable = all(skull);
  measurable[5] = false;
  const Eigen::VectorXd thickness = tissue_thickness(skull, measurable, skin).value();
  for (Eigen::Index v = 0; v < thickness.size(); ++v) {
    const double z = skull.vertices(v, 2);
    if (std::abs(z) < 1.0) continue;  // nearest to the very edge
    if (v == 5 || z < 0.0) {
      EXPECT_TRUE(std::isnan(thickness[v])) << v << " at height " << z;
    } else {
      EXPECT_NEAR(thickness[v], 6.0, 0.1) << v;
    }
  }
}

TEST(TissueThickness, SkinBehindTheBoneIsNotItsSkin) {
  TriangleMesh skull = sphere(80.0, 12, 20);
  skull.normals = -skull.normals;
  const Eigen::VectorXd thickness =
      tissue_thickness(skull, all(skull), sphere(86.0, 60, 120)).value();
  EXPECT_TRUE(thickness.array().isNaN().all());
}

TEST(TissueThickness, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh skull = sphere(80.0, 30, 60);
  const TriangleMesh skin = sphere(90.0, 30, 40);
  const auto run = [&](int threads) {
    ThicknessOptions options;
    options.threads = threads;
    return tissue_thickness(skull, all(skull), skin, options).value();
  };
  EXPECT_EQ(run(1), run(3));
}

TEST(TissueThickness, RefusesASkinWithoutTriangles) {
  const TriangleMesh skull = sphere(80.0, 4, 5);
  EXPECT_THAT(tissue_thickness(skull, all(skull), {}).error().what,
              ::testing::HasSubstr("no triangles"));
  EXPECT_THAT(tissue_thickness(skull, {true}, sphere(90.0, 4, 5)).error().what,
              ::testing::HasSubstr("1 flags"));
}

}  // namespace
}  // namespace skullstation
