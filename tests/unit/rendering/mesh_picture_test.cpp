#include "reconstruction/rendering/mesh_picture.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <limits>

#include "reconstruction/rendering/picture_sheet.h"
#include "reconstruction/rendering/ray_scene.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

/// A box from `low` to `high`, outward.
TriangleMesh box(const Vector3d& low, const Vector3d& high) {
  TriangleMesh mesh;
  mesh.vertices.resize(8, 3);
  for (int v = 0; v < 8; ++v) {
    mesh.vertices.row(v) << ((v & 1) ? high : low).x(), ((v & 2) ? high : low).y(),
        ((v & 4) ? high : low).z();
  }
  mesh.triangles.resize(12, 3);
  mesh.triangles << 0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4, 2, 6, 7, 2, 7, 3, 0, 4, 6,
      0, 6, 2, 1, 3, 7, 1, 7, 5;
  return mesh;
}

const PictureOptions small = {.width = 64, .height = 48, .samples = 16};

PictureCamera front_of(const TriangleMesh& mesh) {
  return look_at(std::array{&mesh}, Vector3d(0, -1, 0), Vector3d::UnitZ(), 64.0 / 48.0);
}

Vector3d pixel(const Image8& image, int x, int y) {
  return {double(image.at(x, y, 0)), double(image.at(x, y, 1)), double(image.at(x, y, 2))};
}

TEST(MeshPicture, FillsThePictureButForAMargin) {
  const TriangleMesh wide = box({-40, -5, -10}, {40, 5, 10});
  PictureOptions options = small;
  options.samples = 1;
  const Image8 image = *render_picture(std::array{PicturedMesh{&wide}}, front_of(wide), options);
  int left = image.width, right = -1;
  for (int x = 0; x < image.width; ++x) {
    if (pixel(image, x, 24) == pixel(image, 0, 0)) continue;
    left = std::min(left, x);
    right = std::max(right, x);
  }
  EXPECT_NEAR(left, 64 * 0.03, 1.5);
  EXPECT_NEAR(right, 63 - 64 * 0.03, 1.5);
}

TEST(MeshPicture, TheViewersRightAndUpAreWhereTheyBelong) {
  // From the front of a person (-y), the person's left (+x) is on the right.
  const TriangleMesh body = box({-20, -5, -20}, {20, 5, 20});
  TriangleMesh left_top = box({10, -9, 10}, {20, -6, 20});
  const std::array meshes = {PicturedMesh{&body, Vector3d(0.5, 0.5, 0.5)},
                             PicturedMesh{&left_top, Vector3d(1.0, 0.0, 0.0)}};
  const Image8 image = *render_picture(meshes, front_of(body), small);
  const auto red = [](const Vector3d& c) { return c.x() > 1.8 * c.y(); };
  EXPECT_TRUE(red(pixel(image, 48, 8)));
  EXPECT_FALSE(red(pixel(image, 16, 8)));
  EXPECT_FALSE(red(pixel(image, 48, 40)));
}

TEST(MeshPicture, LightComesFromTheUpperLeftAndHollowsAreDarker) {
  const TriangleMesh cube = box({-10, -10, -10}, {10, 10, 10});
  const PictureCamera camera = look_at(std::array{&cube}, Vector3d(0, -1, 1), Vector3d::UnitZ(), 1);
  PictureOptions options = small;
  options.width = options.height = 64;
  const Image8 image = *render_picture(std::array{PicturedMesh{&cube}}, camera, options);
  EXPECT_GT(pixel(image, 32, 16).x(), pixel(image, 32, 48).x() + 10) << "top above front";

  // The same wall with a deep ledge over it gets less light.
  const TriangleMesh wall = box({-30, 0, -30}, {30, 5, 30});
  const TriangleMesh ledge = box({-30, -40, 5}, {30, 0, 10});
  const PictureCamera front = front_of(wall);
  const Image8 free = *render_picture(std::array{PicturedMesh{&wall}}, front, small);
  const Image8 under =
      *render_picture(std::array{PicturedMesh{&wall}, PicturedMesh{&ledge}}, front, small);
  EXPECT_LT(pixel(under, 32, 30).x(), pixel(free, 32, 30).x() - 20);
}

TEST(MeshPicture, WhatIsSeeThroughShowsWhatIsBehind) {
  const TriangleMesh wall = box({-20, 10, -20}, {20, 12, 20});
  const TriangleMesh pane = box({-20, -2, -20}, {20, 2, 20});
  const PicturedMesh red{&wall, Vector3d(1, 0, 0)};
  const PictureCamera camera = front_of(pane);
  const Image8 clear =
      *render_picture(std::array{red, PicturedMesh{&pane, Vector3d(0, 0, 1), 0.2}}, camera, small);
  const Image8 solid =
      *render_picture(std::array{red, PicturedMesh{&pane, Vector3d(0, 0, 1)}}, camera, small);
  EXPECT_GT(pixel(clear, 32, 24).x(), 100);
  EXPECT_GT(pixel(clear, 32, 24).z(), 20);
  EXPECT_EQ(pixel(solid, 32, 24).x(), 0);
}

TEST(MeshPicture, VertexColorsWin) {
  TriangleMesh green = box({-20, -5, -20}, {20, 5, 20});
  green.colors = Colors::Zero(8, 3);
  green.colors.col(1).setConstant(255);
  const Image8 image = *render_picture(std::array{PicturedMesh{&green}}, front_of(green), small);
  EXPECT_EQ(pixel(image, 32, 24).x(), 0);
  EXPECT_GT(pixel(image, 32, 24).y(), 150);
}

TEST(MeshPicture, TheSameBytesForAnyNumberOfThreads) {
  const TriangleMesh cube = box({-10, -10, -10}, {10, 10, 10});
  PictureOptions options = small;
  options.threads = 1;
  const auto one = render_picture(std::array{PicturedMesh{&cube}}, front_of(cube), options);
  options.threads = 4;
  EXPECT_EQ(*one, *render_picture(std::array{PicturedMesh{&cube}}, front_of(cube), options));
}

TEST(MeshPicture, BadMeshesAndOptionsAreNamed) {
  TriangleMesh cube = box({-10, -10, -10}, {10, 10, 10});
  const PictureCamera camera = front_of(cube);
  PictureOptions options = small;
  options.samples = 0;
  EXPECT_EQ(render_picture(std::array{PicturedMesh{&cube}}, camera, options).error().kind,
            ErrorKind::usage);
  EXPECT_EQ(render_picture(std::array{PicturedMesh{&cube, Vector3d::Ones(), 0.0}}, camera, small)
                .error()
                .kind,
            ErrorKind::usage);
  cube.colors = Colors::Zero(3, 3);
  EXPECT_THAT(render_picture(std::array{PicturedMesh{&cube}}, camera, small).error().message(),
              testing::HasSubstr("3 colours for 8 vertices"));
  cube.triangles(5, 1) = 8;
  EXPECT_EQ(render_picture(std::array{PicturedMesh{&cube}}, camera, small).error().kind,
            ErrorKind::bad_input);
}

TEST(MeshPicture, SidesShareOneScale) {
  const TriangleMesh tall = box({-5, -5, -40}, {5, 5, 40});
  PictureOptions options = small;
  options.samples = 1;
  const auto pictures = render_sides(std::array{PicturedMesh{&tall}}, head_sides(), options);
  ASSERT_TRUE(pictures);
  ASSERT_EQ(pictures->size(), 8U);
  const auto seen = [](const Image8& image) {
    int count = 0;
    for (int y = 0; y < image.height; ++y) {
      for (int x = 0; x < image.width; ++x) count += pixel(image, x, y) != pixel(image, 0, 0);
    }
    return count;
  };
  EXPECT_NEAR(seen((*pictures)[0]), 8.0 * seen((*pictures)[6]), 0.4 * seen((*pictures)[0]));

  const Image8 sheet = picture_sheet(*pictures, 3);
  EXPECT_EQ(sheet.width, 3 * 64);
  EXPECT_EQ(sheet.height, 3 * 48);
  EXPECT_EQ(pixel(sheet, 191, 143), Vector3d(255, 255, 255)) << "the ninth place stays empty";
}

TEST(RayScene, FindsWhatIsHitAndWhatBlocks) {
  const TriangleMesh near = box({-1, -1, -1}, {1, 1, 1});
  const TriangleMesh far = box({-1, 9, -1}, {1, 11, 1});
  const RayScene scene(std::array{&near, &far});
  const Vector3d origin(0.3, -10, 0.2);
  const auto first = scene.first_hit(origin, Vector3d::UnitY());
  ASSERT_TRUE(first);
  EXPECT_EQ(first->mesh, 0);
  EXPECT_NEAR(first->distance_mm, 9.0, 1e-5);
  const auto behind = scene.first_hit(origin, Vector3d::UnitY(), 12.0);
  ASSERT_TRUE(behind);
  EXPECT_EQ(behind->mesh, 1);
  EXPECT_NEAR(behind->distance_mm, 19.0, 1e-5);
  EXPECT_FALSE(scene.first_hit(origin, Vector3d::UnitZ()));
  EXPECT_TRUE(scene.blocked(origin, Vector3d::UnitY(), 10.0));
  EXPECT_FALSE(scene.blocked(origin, Vector3d::UnitY(), 8.0));
}

}  // namespace
}  // namespace skullstation
