#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "reconstruction/photogrammetry/patch_match_score.h"
#include "reconstruction/photogrammetry/source_views.h"
#include "reconstruction/photogrammetry/visual_hull.h"
#include "tests/unit/photogrammetry/ball_scene.h"

namespace skullstation {
namespace {

TEST(VisualHull, HoldsTheBallAndNotMuchElse) {
  const BallScene scene;
  const auto views = photograph(scene);
  const auto hull = carve_visual_hull(views, 48, 1);
  ASSERT_TRUE(hull) << hull.error().message();
  double volume = 0.0;
  for (int z = 0; z < hull->size.z(); ++z) {
    for (int y = 0; y < hull->size.y(); ++y) {
      for (int x = 0; x < hull->size.x(); ++x) {
        const Eigen::Vector3d centre =
            hull->origin_mm + hull->voxel_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const bool inside = hull->inside[hull->index(x, y, z)] != 0;
        if (inside) volume += hull->voxel_mm * hull->voxel_mm * hull->voxel_mm;
        const double from_surface = (centre - scene.centre_mm).norm() - scene.radius_mm;
        if (from_surface < 0.0) {
          EXPECT_TRUE(inside) << centre.transpose();
        }
      }
    }
  }
  const double ball = 4.18879 * scene.radius_mm * scene.radius_mm * scene.radius_mm;
  EXPECT_LT(volume, 1.6 * ball);
  EXPECT_LT((hull->centre_mm() - scene.centre_mm).norm(), 5.0);
}

TEST(VisualHull, BoundsTheDepthOfEachPixel) {
  const BallScene scene;
  const auto views = photograph(scene);
  const auto hull = carve_visual_hull(views, 48, 2);
  ASSERT_TRUE(hull);
  const StereoView& view = views[3];
  const HullRange range = hull_range(*hull, view.camera, view.camera_from_table);
  for (int y = 0; y < scene.height; ++y) {
    for (int x = 0; x < scene.width; ++x) {
      const double depth = scene.depth_mm(view.camera, view.camera_from_table, x + 0.5, y + 0.5);
      if (depth == 0.0) continue;
      const std::size_t i = static_cast<std::size_t>(y) * scene.width + x;
      EXPECT_GE(range.nearest[i], 1.0 / depth);
      EXPECT_LE(range.farthest[i], 1.0 / depth);
      EXPECT_GT(range.farthest[i], 0.0f);
    }
  }
}

TEST(VisualHull, ContradictingMasksAreNoHull) {
  auto views = photograph(BallScene{});
  for (std::size_t v = 0; v < views.size(); v += 2) {
    views[v].camera_from_table.translation.x() += 100.0;  // looks past the specimen
  }
  const auto hull = carve_visual_hull(views, 32, 1);
  ASSERT_FALSE(hull);
  EXPECT_EQ(hull.error().kind, ErrorKind::no_result);
}

TEST(SourceViews, AreNeighboursOnBothSidesAndOfTheSamePass) {
  auto views = photograph(BallScene{});
  views[1].pass = 1;
  const auto chosen = choose_source_views(views, BallScene{}.centre_mm, {.count = 4});
  // 18 views, 20 deg apart on the table; view 1 shows another placement.
  EXPECT_THAT(chosen[0], testing::Not(testing::Contains(1)));
  EXPECT_THAT(chosen[0], testing::Contains(17));
  EXPECT_THAT(chosen[5], testing::IsSupersetOf({4, 6}));
  EXPECT_TRUE(chosen[1].empty());
}

struct Scored {
  Image8 grey, mask;
  QuadImage quads;
  PixelWarp warp;
};

/// Two cameras side by side before a textured wall at 500 mm; the second is 20 mm to the right.
Scored wall(bool reference) {
  Scored side;
  side.grey = Image8(64, 48, 1);
  side.mask = Image8(64, 48, 1, 255);
  const double shift = reference ? 0.0 : 20.0 * 400.0 / 500.0;  // 16 px
  for (int y = 0; y < 48; ++y) {
    for (int x = 0; x < 64; ++x) {
      const double u = x + shift;
      side.grey.at(x, y) = static_cast<std::uint8_t>(
          128 + 50 * std::sin(0.9 * u) * std::cos(0.8 * y) + 40 * std::sin(0.31 * u + 0.5 * y));
    }
  }
  side.quads = packed_quads(side.grey);
  return side;
}

TEST(PatchScore, IsLeastAtTheTruePlane) {
  const Scored reference = wall(true);
  const Scored source = wall(false);
  const Pinhole camera{64, 48, 400.0, 400.0, 32.0, 24.0};
  Rigid3 source_from_table;
  source_from_table.translation = {-20.0, 0.0, 0.0};
  const PixelWarp warp = pixel_warp(camera, Rigid3{}, camera, source_from_table);
  const PatchMaker maker({});
  Patch patch;
  maker.make(reference.grey, reference.mask, 40, 22, patch);
  const QuadImage* const images[] = {&source.quads};
  const std::uint8_t named[] = {0};
  const auto cost = [&](double depth_mm, float gx) {
    float result = -1.0f;
    score_plane(patch, maker.noise_variance(), 40.5f, 22.5f,
                {static_cast<float>(1.0 / depth_mm), gx, 0.0f}, images, &warp, named, 1, &result);
    return result;
  };
  EXPECT_LT(cost(500.0, 0.0f), 0.01f);
  EXPECT_GT(cost(490.0, 0.0f), cost(500.0, 0.0f) + 0.02f);
  EXPECT_GT(cost(511.0, 0.0f), cost(500.0, 0.0f) + 0.02f);
  EXPECT_GT(cost(500.0, 2e-5f), cost(500.0, 0.0f) + 0.02f);
  EXPECT_EQ(cost(150.0, 0.0f), kWorstCost) << "it leaves the image";
}

TEST(PatchScore, IgnoresBrightnessAndContrast) {
  Scored reference = wall(true);
  const Scored same = wall(true);
  for (std::uint8_t& pixel : reference.grey.pixels) {
    pixel = static_cast<std::uint8_t>(40 + pixel / 2);
  }
  const PatchMaker maker({.color_sd = 1000.0});
  Patch patch;
  maker.make(reference.grey, reference.mask, 30, 20, patch);
  PixelWarp identity;
  identity.a = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  const QuadImage* const images[] = {&same.quads};
  const std::uint8_t named[] = {0};
  float cost = -1.0f;
  score_plane(patch, maker.noise_variance(), 30.5f, 20.5f, {0.002f, 0.0f, 0.0f}, images, &identity,
              named, 1, &cost);
  EXPECT_LT(cost, 0.01f);
}

TEST(PatchScore, EveryWidthOfVectorsGivesTheSameBytes) {
  const Scored source = wall(false);
  const PatchMaker maker({});
  Patch patch;
  maker.make(wall(true).grey, source.mask, 31, 17, patch);
  const float a[9] = {1.01f, 0.02f, 0.3f, -0.01f, 0.98f, 0.7f, 1e-5f, -2e-5f, 1.0f};
  const float b[3] = {-7000.0f, 55.0f, 0.4f};
  ScoreInput in{patch_offsets().x.data(),
                patch_offsets().y.data(),
                patch.weight.data(),
                patch.contrast.data(),
                patch.mean,
                1.0f,
                31.5f,
                17.5f,
                0.001f,
                1e-6f,
                3e-6f,
                1,
                {{source.quads.quads.data(), source.quads.width, source.quads.height, a, b}}};
  float portable = -1.0f;
  score_portable(in, &portable);
  EXPECT_GT(portable, 0.0f);
  EXPECT_LT(portable, 2.0f);
#if defined(__x86_64__)
  if (__builtin_cpu_supports("avx2")) {
    float wide = -1.0f;
    score_avx2(in, &wide);
    EXPECT_EQ(wide, portable);
  }
  if (__builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl")) {
    float wider = -1.0f;
    score_avx512(in, &wider);
    EXPECT_EQ(wider, portable);
  }
#endif
}

}  // namespace
}  // namespace skullstation
