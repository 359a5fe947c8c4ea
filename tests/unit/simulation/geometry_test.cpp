// Where things appear in the simulated pictures, against the lens and the poses alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>
#include <vector>

#include "capture/simulation/render.h"
#include "capture/simulation/sensor.h"
#include "core/session/charuco_board.h"
#include "core/units.h"
#include "tests/unit/simulation/test_scene.h"

namespace skullstation {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

const Vector3d box_size_mm(80.0, 80.0, 100.0);

/// A white box on the table's axis, from the table up.
std::shared_ptr<SimulatedScene> white_box() {
  static const std::shared_ptr<SimulatedScene> scene = [] {
    const TriangleMesh box = testing::painted(testing::box_mesh(box_size_mm), {255, 255, 255});
    return testing::make_scene(box, rest_on_table(box, Eigen::Quaterniond::Identity()),
                               testing::plain_room());
  }();
  return scene;
}

CameraOptics distorted(CameraOptics optics) {
  const Lens& lens = optics.lens;
  optics.lens = Lens::from_params(lens.width, lens.height, LensModel::opencv,
                                  {lens.fx, lens.fy, lens.cx, lens.cy, -0.9, 2.0, 0.004, -0.003});
  return optics;
}

TEST(SimulatedGeometry, APositiveAngleTurnsTheSpecimenCounterClockwiseSeenFromAbove) {
  const double radius_mm = 15.0;
  Rigid3 beside_the_axis;
  beside_the_axis.translation = {70.0, 0.0, 50.0};  // to the camera's right
  const auto scene = testing::make_scene(testing::sphere_mesh(radius_mm, 4), beside_the_axis,
                                         testing::plain_room());
  const CameraOptics optics = testing::small_optics(0.0);
  const PreparedOptics prepared = testing::prepared(optics);
  struct Expected {
    double table_angle_deg, right_mm, far_mm;
  };
  for (const auto& [angle_deg, right_mm, far_mm] :
       {Expected{0.0, 70.0, 0.0}, Expected{30.0, 70.0 * std::sqrt(0.75), 35.0},
        Expected{90.0, 0.0, 70.0}, Expected{270.0, 0.0, -70.0}}) {
    const ViewTruth truth = render_truth(*scene->placed(), prepared, angle_deg, 2);
    const double z_mm = 650.0 + far_mm;
    const Vector2d centre(optics.lens.cx + optics.lens.fx * right_mm / z_mm, optics.lens.cy);
    const int x = static_cast<int>(centre.x());
    const int y = static_cast<int>(centre.y());
    ASSERT_EQ(truth.object.at(x, y), static_cast<int>(SceneObject::specimen)) << angle_deg;
    EXPECT_NEAR(truth.depth_mm.at(x, y), z_mm - radius_mm, 2.0) << angle_deg;
    Vector2d sum = Vector2d::Zero();
    int count = 0;
    for (int v = 0; v < truth.object.height; ++v) {
      for (int u = 0; u < truth.object.width; ++u) {
        if (truth.object.at(u, v) != static_cast<int>(SceneObject::specimen)) continue;
        sum += Vector2d(u + 0.5, v + 0.5);
        ++count;
      }
    }
    EXPECT_LT((sum / count - centre).norm(), 0.4) << angle_deg;
  }
}

TEST(SimulatedGeometry, RaysAreTheLenssOwn) {
  const CameraOptics optics = distorted(testing::small_optics(25.0));
  const PreparedOptics prepared = testing::prepared(optics);
  for (double y = 0.25; y < 120.0; y += 7.1) {
    for (double x = 0.25; x < 160.0; x += 7.3) {
      const Vector2d px = optics.lens.project(prepared.ray(x, y).homogeneous());
      EXPECT_LT((px - Vector2d(x, y)).norm(), 0.002) << x << " " << y;
    }
  }
}

TEST(SimulatedGeometry, TrueDepthPutsTheBoardIntoItsPlane) {
  SceneOptions room = testing::board_room();
  room.table_from_board = rotation_about_z(12.0);
  room.table_from_board.translation = {4.0, -3.0, 0.0};
  const auto scene = testing::make_scene({}, {}, room);
  const CameraOptics optics = distorted(testing::small_optics(40.0));
  const PreparedOptics prepared = testing::prepared(optics);
  const ViewTruth truth = render_truth(*scene->placed(), prepared, 33.0, 2);
  const Rigid3 board_from_camera =
      (optics.camera_from_station * rotation_about_z(33.0) * room.table_from_board).inverse();
  int on_board = 0;
  for (int y = 0; y < truth.object.height; ++y) {
    for (int x = 0; x < truth.object.width; ++x) {
      if (truth.object.at(x, y) != static_cast<int>(SceneObject::board)) continue;
      const Vector3d in_camera = static_cast<double>(truth.depth_mm.at(x, y)) *
                                 optics.lens.ray({x + 0.5, y + 0.5}).value();
      const Vector3d place = board_from_camera * in_camera;
      if (place.z() < -0.5) continue;  // the plate's side
      ++on_board;
      EXPECT_NEAR(place.z(), 0.0, 0.01);
      EXPECT_LT(place.head<2>().cwiseAbs().maxCoeff(), 175.0 + room.board_border_mm + 0.01);
    }
  }
  EXPECT_GT(on_board, 2000);
}

TEST(SimulatedGeometry, TheBoardsCornersAppearWhereItsGeometrySays) {
  SceneOptions room = testing::board_room();
  room.table_from_board = rotation_about_z(12.0);
  room.table_from_board.translation = {4.0, -3.0, 0.0};
  const auto scene = testing::make_scene({}, {}, room);
  CameraOptics optics = testing::small_optics(60.0);
  optics.lens = Lens::from_params(320, 240, LensModel::opencv,
                                  {380.0, 380.0, 161.2, 118.9, -0.1, 0.05, 0.001, -0.001});
  optics.camera_from_station = camera_on_ring({0.0, 0.0, 0.0}, 650.0, 60.0);
  for (const double table_angle_deg : {0.0, 50.0}) {
    const Image8 image =
        develop(testing::picture(*scene, optics, table_angle_deg), SensorOptions{}, {}, 1, 2);
    const auto corners = detect_board(image, *room.board);
    EXPECT_GE(corners.size(), 34U);  // of 36
    double squares = 0.0;
    for (const BoardCorner& corner : corners) {
      const Vector3d in_table = room.table_from_board * room.board->corner(corner.id);
      squares +=
          (testing::project(optics, table_angle_deg, in_table) - corner.position_px).squaredNorm();
    }
    EXPECT_LT(std::sqrt(squares / static_cast<double>(corners.size())), 0.1) << table_angle_deg;
  }
}

TEST(SimulatedGeometry, SameBytesForAnyNumberOfThreads) {
  CameraOptics optics = testing::small_optics(25.0);
  optics.aperture_mm = 3.0;
  const PreparedOptics prepared = testing::prepared(optics);
  const double angles_deg[] = {10.0, 11.0, 13.0};
  const auto render = [&](int threads) {
    RenderOptions options;
    options.threads = threads;
    return render_radiance(*white_box()->placed(), prepared, angles_deg, options);
  };
  const ImageF one = render(1);
  EXPECT_EQ(one, render(2));
  EXPECT_EQ(one, render(3));
}

TEST(SimulatedGeometry, LightFallsOffByTheFourthPowerOfTheCosine) {
  CameraOptics optics = testing::small_optics(0.0);
  const ImageF even = testing::picture(*white_box(), optics, 0.0);
  optics.vignetting = 1.0;
  const ImageF vignetted = testing::picture(*white_box(), optics, 0.0);
  for (int y = 0; y < even.height; y += 7) {
    for (int x = 0; x < even.width; x += 7) {
      const Vector2d slope((x + 0.5 - optics.lens.cx) / optics.lens.fx,
                           (y + 0.5 - optics.lens.cy) / optics.lens.fy);
      const double cosine = 1.0 / std::sqrt(1.0 + slope.squaredNorm());
      EXPECT_NEAR(vignetted.at(x, y, 1), even.at(x, y, 1) * std::pow(cosine, 4), 1e-5);
    }
  }
}

TEST(SimulatedGeometry, OpticsThatMakeNoSenseAreRefused) {
  const auto refused = [](const auto& change) {
    CameraOptics optics = testing::small_optics();
    change(optics);
    const auto prepared = PreparedOptics::prepare(optics, 2);
    return !prepared && prepared.error().kind == ErrorKind::bad_input;
  };
  EXPECT_FALSE(refused([](CameraOptics&) {}));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.lens.width = 0; }));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.lens.fx = -1.0; }));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.aperture_mm = -1.0; }));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.focus_distance_mm = 0.0; }));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.vignetting = -1.0; }));
  EXPECT_TRUE(refused([](CameraOptics& o) { o.lens.k1 = -30.0; }));  // folds inside the image
}

}  // namespace
}  // namespace skullstation
