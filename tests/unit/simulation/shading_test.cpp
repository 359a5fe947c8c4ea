// How specimens of all sorts are lit, whatever their meshes are like.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/simulation/lamps.h"
#include "capture/simulation/shading_mesh.h"
#include "tests/unit/simulation/test_scene.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

const Eigen::Vector3i white(255, 255, 255);

Rigid3 raised(double height_mm, double turn_deg = 0.0) {
  Rigid3 pose = rotation_about_z(turn_deg);
  pose.translation.z() = height_mm;
  return pose;
}

ImageF shown(const TriangleMesh& mesh, const Rigid3& pose) {
  return testing::picture(*testing::make_scene(mesh, pose, testing::plain_room()),
                          testing::small_optics(0.0), 0.0);
}

TEST(SimulatedShading, TheMeshsOwnNormalsAreNotAsked) {
  TriangleMesh box = testing::painted(testing::box_mesh({80.0, 80.0, 100.0}), white);
  const ImageF without = shown(box, raised(50.0, 30.0));
  box.normals = Points3::Constant(box.vertices.rows(), 3, std::sqrt(1.0 / 3.0));
  EXPECT_EQ(shown(box, raised(50.0, 30.0)), without);
}

TEST(SimulatedShading, AnOpenSurfaceIsLitOnTheSideThatIsSeen) {
  TriangleMesh sheet = testing::painted(testing::box_mesh({80.0, 80.0, 100.0}), white);
  const Triangles front = sheet.triangles.middleRows(4, 2);  // the side towards the camera
  sheet.triangles = front;
  const ImageF right_side = shown(sheet, raised(50.0));
  sheet.triangles.col(1).swap(sheet.triangles.col(2));
  const ImageF wrong_side = shown(sheet, raised(50.0));
  EXPECT_GT(right_side.at(80, 60, 1), 0.5F);
  EXPECT_NEAR(wrong_side.at(80, 60, 1), right_side.at(80, 60, 1), 0.01);
}

TEST(SimulatedShading, TrianglesWithoutAreaDoNoHarm) {
  TriangleMesh box = testing::painted(testing::box_mesh({80.0, 80.0, 100.0}), white);
  const ImageF clean = shown(box, raised(50.0, 30.0));
  const Eigen::Index count = box.triangles.rows();
  box.triangles.conservativeResize(count + 2, 3);
  box.triangles.row(count) << 0, 1, 1;
  box.triangles.row(count + 1) << 5, 5, 5;
  const ImageF image = shown(box, raised(50.0, 30.0));
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    ASSERT_TRUE(std::isfinite(image.pixels[i]));
    EXPECT_NEAR(image.pixels[i], clean.pixels[i], 0.05F);
  }
}

TEST(SimulatedShading, BoneWithoutColoursIsIvoryWithTexture) {
  const ImageF image = shown(testing::box_mesh({80.0, 80.0, 100.0}), raised(50.0));
  double sum[3] = {};
  float least = 1.0F;
  float most = 0.0F;
  for (int y = 45; y < 75; ++y) {
    for (int x = 70; x < 90; ++x) {
      for (int channel = 0; channel < 3; ++channel) {
        sum[channel] += static_cast<double>(image.at(x, y, channel));
      }
      least = std::min(least, image.at(x, y, 1));
      most = std::max(most, image.at(x, y, 1));
    }
  }
  EXPECT_GT(sum[0], sum[1]);
  EXPECT_GT(sum[1], 1.1 * sum[2]);
  EXPECT_GT(most, 1.1F * least);
}

TEST(SimulatedShading, MeshesThatMakeNoSenseAreRefused) {
  const TriangleMesh sound = testing::box_mesh({10.0, 10.0, 10.0});
  const auto refused = [&](const auto& change) {
    TriangleMesh mesh = sound;
    change(mesh);
    const auto scene = SimulatedScene::build(mesh, {}, testing::plain_room(), 2);
    return !scene && scene.error().kind == ErrorKind::bad_input;
  };
  EXPECT_FALSE(refused([](TriangleMesh&) {}));
  EXPECT_TRUE(refused(
      [](TriangleMesh& m) { m.vertices(3, 1) = std::numeric_limits<double>::quiet_NaN(); }));
  EXPECT_TRUE(refused([](TriangleMesh& m) { m.triangles(2, 0) = 8; }));
  EXPECT_TRUE(refused([](TriangleMesh& m) { m.triangles(2, 0) = -1; }));
  EXPECT_TRUE(refused([](TriangleMesh& m) { m.colors.resize(3, 3); }));
}

TEST(SimulatedShading, DividingATriangleLeavesTheSurfaceAsItIs) {
  const TriangleMesh box = testing::box_mesh({80.0, 60.0, 100.0});
  const auto divided = make_shading_mesh(box, 6.0, 1'000'000);
  ASSERT_TRUE(divided);
  TriangleMesh same;
  same.vertices = divided->vertices;
  same.triangles = divided->triangles;
  EXPECT_NEAR(surface_area(same), surface_area(box), 1e-6);
  double longest = 0.0;
  for (Eigen::Index t = 0; t < same.triangles.rows(); ++t) {
    for (int i = 0; i < 3; ++i) {
      longest = std::max(longest, (same.vertices.row(same.triangles(t, i)) -
                                   same.vertices.row(same.triangles(t, (i + 1) % 3)))
                                      .norm());
    }
  }
  EXPECT_LE(longest, 6.0);
  // One edge has two triangles: no gaps.
  EXPECT_EQ(same.vertices.rows() - same.triangles.rows() / 2, 2);
}

}  // namespace
}  // namespace skullstation
