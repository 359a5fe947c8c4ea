// Where things appear in the simulated pictures, against the lens and the poses alone.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
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
                               testing::even_room());
  }();
  return scene;
}

CameraOptics distorted(CameraOptics optics) {
  const Lens& lens = optics.lens;
  optics.lens = Lens::from_params(lens.width, lens.height, LensModel::opencv,
                                  {lens.fx, lens.fy, lens.cx, lens.cy, -0.9, 2.0, 0.004, -0.003});
  return optics;
}

/// The box's twelve edges in the image, as finely divided polygons.
std::vector<std::vector<Vector2d>> edges_px(const CameraOptics& optics, double table_angle_deg) {
  std::vector<std::vector<Vector2d>> edges;
  for (int axis = 0; axis < 3; ++axis) {
    for (int side = 0; side < 4; ++side) {
      Vector3d begin;
      begin[axis] = -0.5;
      begin[(axis + 1) % 3] = (side & 1) - 0.5;
      begin[(axis + 2) % 3] = (side >> 1) - 0.5;
      std::vector<Vector2d>& edge = edges.emplace_back();
      for (int i = 0; i <= 200; ++i) {
        const Vector3d unit = begin + i / 200.0 * Vector3d::Unit(axis) + Vector3d(0, 0, 0.5);
        edge.push_back(testing::project(optics, table_angle_deg, unit.cwiseProduct(box_size_mm)));
      }
    }
  }
  return edges;
}

/// The least and the greatest place along `axis` at which an edge crosses the line across it.
std::optional<std::pair<double, double>> outline_on(const std::vector<std::vector<Vector2d>>& edges,
                                                    int axis, double line) {
  std::vector<double> places;
  for (const auto& edge : edges) {
    for (std::size_t i = 1; i < edge.size(); ++i) {
      const double before = edge[i - 1][1 - axis] - line;
      const double after = edge[i][1 - axis] - line;
      if (before * after > 0.0 || before == after) continue;
      places.push_back(std::lerp(edge[i - 1][axis], edge[i][axis], before / (before - after)));
    }
  }
  std::ranges::sort(places);
  // Beside an inner edge the levels on both sides of an outline can't be told.
  constexpr double apart_px = 6.0;
  const std::size_t count = places.size();
  if (count < 2 || places[1] - places[0] < apart_px ||
      places[count - 1] - places[count - 2] < apart_px) {
    return std::nullopt;
  }
  return std::pair{places.front(), places.back()};
}

/// The image's green channel along a row (axis 0) or a column (axis 1).
std::vector<double> profile(const ImageF& image, int axis, int line) {
  std::vector<double> values(static_cast<std::size_t>(axis == 0 ? image.width : image.height));
  for (int i = 0; i < static_cast<int>(values.size()); ++i) {
    values[static_cast<std::size_t>(i)] =
        static_cast<double>(axis == 0 ? image.at(i, line, 1) : image.at(line, i, 1));
  }
  return values;
}

/// Where the profile steps between two levels near `expected`: the place that divides its light.
/// `bright_after` tells on which side the specimen is.
double step_place(const std::vector<double>& values, double expected, bool bright_after) {
  // No wider than the step: the surface itself grows darker towards its edges.
  const int begin = static_cast<int>(expected) - 1;
  const int end = static_cast<int>(expected) + 2;
  const double first = values[static_cast<std::size_t>(begin - 1)];
  const double last = values[static_cast<std::size_t>(end)];
  double after = 0.0;
  for (int i = begin; i < end; ++i) {
    after += (values[static_cast<std::size_t>(i)] - first) / (last - first);
  }
  EXPECT_EQ(last > first, bright_after);
  return end - after;
}

struct OutlineErrors {
  int places = 0;
  double greatest_px = 0.0;
  double mean_px = 0.0;
};

OutlineErrors outline_errors(const CameraOptics& optics, double table_angle_deg) {
  const ImageF image = testing::picture(*white_box(), optics, table_angle_deg);
  const auto edges = edges_px(optics, table_angle_deg);
  OutlineErrors errors;
  for (int axis = 0; axis < 2; ++axis) {
    const int lines = axis == 0 ? image.height : image.width;
    const int length = axis == 0 ? image.width : image.height;
    for (int line = 4; line + 4 < lines; ++line) {
      const auto here = outline_on(edges, axis, line + 0.5);
      const auto before = outline_on(edges, axis, line - 3.0);
      const auto after = outline_on(edges, axis, line + 4.0);
      if (!here || !before || !after) continue;
      const std::vector<double> values = profile(image, axis, line);
      const auto compare = [&](double begin, double place, double end, bool bright_after) {
        // Straight, and across the line rather than along it; wholly in the image.
        if (std::abs(end - begin) > 4.0 || std::abs(0.5 * (begin + end) - place) > 0.05) return;
        if (place < 6.0 || place > length - 6.0) return;
        const double error = step_place(values, place, bright_after) - place;
        errors.greatest_px = std::max(errors.greatest_px, std::abs(error));
        errors.mean_px = (errors.mean_px * errors.places + error) / (errors.places + 1);
        ++errors.places;
      };
      if (here->second - here->first < 20.0) continue;
      compare(before->first, here->first, after->first, true);
      // The lowest edge borders on the unlit underside and is no clean step.
      if (axis == 0) compare(before->second, here->second, after->second, false);
    }
  }
  return errors;
}

TEST(SimulatedGeometry, OutlinesLieWhereLensAndPoseSay) {
  for (const CameraOptics& optics : {testing::small_optics(0.0), testing::small_optics(25.0),
                                     distorted(testing::small_optics(25.0))}) {
    for (const double table_angle_deg : {33.0, 20.0, 200.0, 317.0}) {
      const OutlineErrors errors = outline_errors(optics, table_angle_deg);
      EXPECT_GT(errors.places, 20);
      EXPECT_LT(errors.greatest_px, 0.12) << optics.lens.k1 << " " << table_angle_deg;
      EXPECT_LT(std::abs(errors.mean_px), 0.03) << optics.lens.k1 << " " << table_angle_deg;
    }
  }
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

/// A thin white plate across the line of sight, nearer to the camera than the axis, so that a turn
/// of the table shifts it sideways.
std::shared_ptr<SimulatedScene> white_plate() {
  static const std::shared_ptr<SimulatedScene> scene = [] {
    Rigid3 before_the_axis;
    before_the_axis.translation = {0.0, -60.0, 50.0};
    return testing::make_scene(
        testing::painted(testing::box_mesh({80.0, 2.0, 100.0}), {255, 255, 255}), before_the_axis,
        testing::even_room());
  }();
  return scene;
}

const Vector3d plate_edge_mm(-40.0, -60.0, 50.0);

/// How far [px] the light of the plate's left edge is spread in the middle row: the mean distance
/// of the profile's steps from the edge, looked at within `reach_px` of it.
double edge_spread_px(const CameraOptics& optics, std::span<const double> table_angles_deg,
                      int reach_px) {
  RenderOptions options;
  options.threads = 2;
  options.samples = 64;
  options.samples_where_uneven = 64;
  options.samples_at_outlines = 64;
  const ImageF image = render_radiance(*white_plate()->placed(), testing::prepared(optics),
                                       table_angles_deg, options);
  const std::vector<double> values = profile(image, 0, 60);
  const double middle_deg = 0.5 * (table_angles_deg.front() + table_angles_deg.back());
  const double edge = testing::project(optics, middle_deg, plate_edge_mm).x();
  const int begin = static_cast<int>(edge) - reach_px;
  const int end = static_cast<int>(edge) + reach_px + 1;
  const double dark = values[static_cast<std::size_t>(begin - 1)];
  const double bright = values[static_cast<std::size_t>(end)];
  double spread = 0.0;
  for (int i = begin; i < end; ++i) {
    const double level = (values[static_cast<std::size_t>(i)] - dark) / (bright - dark);
    spread += std::abs(level - std::clamp(i + 1.0 - edge, 0.0, 1.0));
  }
  return spread;
}

TEST(SimulatedGeometry, MotionBlurIsAsLongAsTheWayMadeWhileExposing) {
  const CameraOptics optics = testing::small_optics(0.0);
  const double still_deg[] = {0.0};
  EXPECT_LT(edge_spread_px(optics, still_deg, 2), 0.08);
  for (const double turned_deg : {4.0, 8.0, 12.0}) {
    const double angles_deg[] = {-turned_deg / 2.0, turned_deg / 2.0};
    const double way_px = testing::project(optics, angles_deg[1], plate_edge_mm).x() -
                          testing::project(optics, angles_deg[0], plate_edge_mm).x();
    // Uniform over the way: its middle is a quarter of it away on average.
    EXPECT_NEAR(edge_spread_px(optics, angles_deg, static_cast<int>(way_px / 2.0) + 2),
                way_px / 4.0, 0.05 * way_px / 4.0 + 0.06)
        << turned_deg;
  }
}

TEST(SimulatedGeometry, DefocusIsAThinLenss) {
  CameraOptics optics = testing::small_optics(0.0);
  const double angle_deg[] = {0.0};
  const double z_mm = (optics.camera_from_station * plate_edge_mm).z();
  optics.aperture_mm = 12.0;
  optics.focus_distance_mm = z_mm;
  EXPECT_LT(edge_spread_px(optics, angle_deg, 2), 0.08) << "in focus";
  for (const double focus_mm : {300.0, 400.0, 2000.0}) {
    optics.focus_distance_mm = focus_mm;
    const double circle_px =
        optics.lens.fx * optics.aperture_mm * std::abs(1.0 / z_mm - 1.0 / focus_mm);
    // A disc's points lie 2 D / (3 pi) from its diameter on average.
    const double expected_px = 2.0 * circle_px / (3.0 * std::numbers::pi);
    EXPECT_NEAR(edge_spread_px(optics, angle_deg, static_cast<int>(circle_px / 2.0) + 2),
                expected_px, 0.05 * expected_px + 0.06)
        << focus_mm;
  }
}

}  // namespace
}  // namespace skullstation
