#include "reconstruction/photogrammetry/texture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "core/units.h"
#include "reconstruction/photogrammetry/coverage.h"
#include "reconstruction/photogrammetry/depth_scatter.h"
#include "reconstruction/photogrammetry/exposure_gains.h"
#include "reconstruction/photogrammetry/mesh_depth.h"
#include "reconstruction/photogrammetry/texture_charts.h"
#include "tests/unit/photogrammetry/ball_scene.h"

namespace skullstation {
namespace {

/// The ball's surface by latitudes and longitudes, both poles cut off.
TriangleMesh ball_mesh(const BallScene& scene, int rows = 40) {
  const int columns = 2 * rows;
  TriangleMesh mesh;
  mesh.vertices.resize((rows + 1) * columns, 3);
  mesh.triangles.resize(2 * rows * columns, 3);
  for (int r = 0; r <= rows; ++r) {
    const double latitude = radians(-80.0 + 160.0 * r / rows);
    for (int c = 0; c < columns; ++c) {
      const double longitude = radians(360.0 * c / columns);
      const Eigen::Vector3d out(std::cos(latitude) * std::cos(longitude),
                                std::cos(latitude) * std::sin(longitude), std::sin(latitude));
      mesh.vertices.row(r * columns + c) = scene.centre_mm + scene.radius_mm * out;
      if (r == rows) continue;
      const int i = r * columns + c;
      const int next = r * columns + (c + 1) % columns;
      mesh.triangles.row(2 * i) << i, next, next + columns;
      mesh.triangles.row(2 * i + 1) << i, next + columns, i + columns;
    }
  }
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

TEST(MeshDepth, IsTheSurfaceThatTheCameraSees) {
  const BallScene scene;
  const auto views = photograph(scene);
  const ImageF depth =
      rendered_inverse_depth(ball_mesh(scene, 120), views[0].camera, views[0].camera_from_table);
  const double true_mm = scene.depth_mm(views[0].camera, views[0].camera_from_table, 70.5, 55.5);
  EXPECT_NEAR(1.0 / depth.at(70, 55), true_mm, 0.05);
  EXPECT_EQ(depth.at(2, 2), 0.0f);
}

TEST(Sights, OnlyWhatFacesTheCameraFreely) {
  BallScene scene;
  const auto views = photograph(scene);
  TriangleMesh mesh = ball_mesh(scene);
  const Eigen::Vector3d to_camera = (views[0].centre_mm() - scene.centre_mm).normalized();
  const Eigen::Vector3d front = scene.centre_mm + scene.radius_mm * to_camera;
  const Eigen::Vector3d back = scene.centre_mm - scene.radius_mm * to_camera;
  const Sights sights(mesh, views, 1.0, 1);
  const auto sight = sights.of(0, front, to_camera);
  ASSERT_TRUE(sight);
  EXPECT_NEAR(sight->cosine, 1.0, 1e-9);
  EXPECT_NEAR(sight->depth_mm, scene.distance_mm - scene.radius_mm, 0.01);
  EXPECT_FALSE(sights.of(0, back, -to_camera)) << "faces away";
  EXPECT_FALSE(sights.of(0, back, to_camera)) << "the ball stands before it";
  EXPECT_FALSE(sights.of(0, front + Eigen::Vector3d(0, 0, 60.0), to_camera)) << "beside the mask";
}

TEST(SurfaceColors, AreThePhotographsBroughtToOneExposure) {
  BallScene scene;
  auto views = photograph(scene);
  const TriangleMesh mesh = ball_mesh(scene);
  const Sights sights(mesh, views, 1.0, 1);
  const Colors even = SurfaceColors(mesh, sights, 1).vertex_colors(1);
  // One view in three is a third darker, in linear light.
  for (std::size_t v = 0; v < views.size(); v += 3) {
    for (std::uint8_t& level : views[v].color.pixels) {
      const double light = std::pow(level / 255.0, 2.2) / 1.5;
      level = static_cast<std::uint8_t>(std::lround(255.0 * std::pow(light, 1.0 / 2.2)));
    }
  }
  const Colors mended = SurfaceColors(mesh, sights, 1).vertex_colors(1);
  double ratio_sum = 0.0, square_sum = 0.0;
  int count = 0;
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const Eigen::Vector3d out = mesh.normals.row(i);
    if (std::abs(out.z()) > 0.7 || even(i, 0) < 30) continue;
    const double ratio = double{mended(i, 0) * 1.0} / even(i, 0);
    ratio_sum += ratio;
    square_sum += ratio * ratio;
    ++count;
  }
  ASSERT_GT(count, 1000);
  const double mean = ratio_sum / count;
  EXPECT_LT(std::sqrt(square_sum / count - mean * mean), 0.03) << "dark and light views show";
}

TEST(SurfaceColors, WhatNoViewSeesIsGrey) {
  BallScene scene;
  scene.elevation_deg = 60.0;
  const auto views = photograph(scene);
  const TriangleMesh mesh = ball_mesh(scene);
  const Sights sights(mesh, views, 1.0, 1);
  const Colors colors = SurfaceColors(mesh, sights, 1).vertex_colors(1);
  EXPECT_EQ(colors(0, 0), 128);  // the lowest row
  EXPECT_EQ(colors(0, 1), 128);
}

TEST(PackRectangles, KeepsThemApartAndInside) {
  std::vector<Eigen::Vector2i> sizes;
  for (int i = 0; i < 60; ++i) sizes.emplace_back(3 + 7 * i % 23, 2 + 5 * i % 19);
  const int side = 128;
  const auto places = pack_rectangles(sizes, side);
  ASSERT_EQ(places.size(), sizes.size());
  std::set<std::pair<int, int>> taken;
  std::size_t area = 0;
  for (std::size_t i = 0; i < sizes.size(); ++i) {
    EXPECT_LE(places[i].x + sizes[i].x(), side);
    EXPECT_LE(places[i].y + sizes[i].y(), side);
    for (int y = 0; y < sizes[i].y(); ++y) {
      for (int x = 0; x < sizes[i].x(); ++x) taken.emplace(places[i].x + x, places[i].y + y);
    }
    area += static_cast<std::size_t>(sizes[i].prod());
  }
  EXPECT_EQ(taken.size(), area) << "two of them overlap";
  EXPECT_TRUE(pack_rectangles({{5, 5}, {6, 6}}, 8).empty()) << "no room for both";
}

/// Texel under a texture coordinate.
int texel(const TexturedSurface& surface, const Eigen::Vector2f& at) {
  const auto side = static_cast<float>(surface.atlas.width);
  return surface.atlas.at(static_cast<int>(at.x() * side), static_cast<int>(at.y() * side));
}

TEST(Texture, ShowsTheColourOfTheSurfaceOnBothSidesOfEverySeam) {
  const BallScene scene;
  const auto views = photograph(scene);
  const TriangleMesh mesh = ball_mesh(scene);
  const Sights sights(mesh, views, 1.0, 1);
  const SurfaceColors colors(mesh, sights, 1);
  const Colors by_vertex = colors.vertex_colors(1);
  const auto textured = make_texture(mesh, sights, colors, {});
  ASSERT_TRUE(textured) << textured.error().message();
  EXPECT_EQ(textured->mesh.triangles.rows(), mesh.triangles.rows());
  ASSERT_EQ(textured->coordinates.size(), static_cast<std::size_t>(textured->mesh.vertices.rows()));
  EXPECT_GT(textured->mesh.vertices.rows(), mesh.vertices.rows()) << "a ball has seams";
  double off_sum = 0.0;
  int count = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int there = textured->mesh.triangles(f, k);
      const int here = mesh.triangles(f, k);
      ASSERT_EQ(textured->mesh.vertices.row(there), mesh.vertices.row(here));
      if (std::abs(mesh.normals(here, 2)) > 0.8) continue;
      off_sum += std::abs(texel(*textured, textured->coordinates[there]) - by_vertex(here, 0));
      ++count;
    }
  }
  // Half a texel aside in a texture of that contrast.
  EXPECT_LT(off_sum / count, 6.0);
  EXPECT_LE(textured->atlas.width, 1024);
}

TEST(Texture, ASmallAtlasIsCoarserAndTheSameForAnyNumberOfThreads) {
  const BallScene scene;
  const auto views = photograph(scene);
  const TriangleMesh mesh = ball_mesh(scene);
  const Sights sights(mesh, views, 1.0, 2);
  TextureOptions options;
  options.largest_side_px = 256;
  options.threads = 1;
  const auto one = make_texture(mesh, sights, SurfaceColors(mesh, sights, 1), options);
  options.threads = 3;
  const auto three = make_texture(mesh, sights, SurfaceColors(mesh, sights, 3), options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->atlas.width, 256);
  EXPECT_TRUE(one->atlas == three->atlas);
  EXPECT_EQ(one->coordinates, three->coordinates);
  EXPECT_EQ(one->mesh.triangles, three->mesh.triangles);
}

TEST(Texture, RefusesSenselessAtlases) {
  EXPECT_FALSE(TextureOptions{.largest_side_px = 1000}.validate());
  EXPECT_FALSE(TextureOptions{.largest_side_px = 64}.validate());
  EXPECT_TRUE(TextureOptions{}.validate());
}

TEST(Coverage, CountsTheViewsAndTheBorder) {
  const BallScene scene;
  const auto views = photograph(scene);
  const TriangleMesh mesh = ball_mesh(scene, 20);
  const Coverage coverage = measure_coverage(mesh, Sights(mesh, views, 1.0, 1), {}, 1);
  // 18 views in a ring: a point of the equator is seen by those less than 80 deg away.
  const int equator = 10 * 40;
  EXPECT_GE(coverage.views[equator], 5);
  EXPECT_LE(coverage.views[equator], 9);
  EXPECT_NEAR(coverage.ground_sample_mm[equator], 230.0 / 420.0, 0.02);
  // Two circles of latitude 80 deg.
  EXPECT_NEAR(coverage.open_edge_mm, 2.0 * 6.283 * 30.0 * std::cos(radians(80.0)), 1.0);
}

TEST(DepthScatter, IsHowFarTheViewsDepthsLieFromTheSurface) {
  const BallScene scene;
  const auto views = photograph(scene);
  auto maps = true_depth_maps(scene, views);
  const TriangleMesh mesh = ball_mesh(scene);
  const int equator = 20 * 80;
  const auto exact = depth_scatter(mesh, maps, 2.0, 1);
  EXPECT_LT(exact[equator], 0.1f);
  EXPECT_EQ(exact[0], 0.0f) << "no view sees the ball from below";

  for (std::size_t m = 0; m < maps.size(); ++m) {
    // 0.46 mm before the surface in one view, behind it in the next, where it faces the camera.
    const float nearer = m % 2 == 0 ? 1.002f : 0.998f;
    for (InversePlane& plane : maps[m].planes) {
      plane = {nearer * plane.w, nearer * plane.gx, nearer * plane.gy};
    }
  }
  const auto off = depth_scatter(mesh, maps, 2.0, 1);
  EXPECT_GT(off[equator], 2.0f * 1.4826f * 0.46f * 0.5f);
  EXPECT_LT(off[equator], 2.0f * 1.4826f * 0.46f);
  EXPECT_EQ(depth_scatter(mesh, maps, 2.0, 3), off);
  EXPECT_EQ(depth_scatter(mesh, maps, 0.01, 1)[equator], 0.0f) << "none within reach";
}

}  // namespace
}  // namespace skullstation
