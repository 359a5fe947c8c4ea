#include "tests/unit/photogrammetry/poses_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/units.h"
#include "reconstruction/photogrammetry/scale_check.h"

namespace skullstation::testing {

namespace {

Rigid3 camera_on_ring(double elevation_deg, double azimuth_deg) {
  constexpr double distance_mm = 740.0;
  const Eigen::Vector3d target(0.0, 0.0, 100.0);
  const double e = radians(elevation_deg);
  const double a = radians(azimuth_deg);
  const Eigen::Vector3d out(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  const Eigen::Vector3d z = -out;
  const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
  Eigen::Matrix3d rows;
  rows << x.transpose(), z.cross(x).transpose(), z.transpose();
  const Eigen::Quaterniond rotation(rows);
  return {rotation, -(rotation * (target + distance_mm * out))};
}

/// Does the ball about (0, 0, 70) with radius 75 stand between the camera and the point?
bool hidden(const Eigen::Vector3d& from, const Eigen::Vector3d& to) {
  const Eigen::Vector3d middle(0.0, 0.0, 70.0);
  const Eigen::Vector3d d = (to - from).normalized();
  const double along = (middle - from).dot(d);
  return (from + along * d - middle).norm() < 75.0 && along < (to - from).norm();
}

}  // namespace

PoseSceneTruth make_pose_scene(const PoseScene& scene) {
  PoseSceneTruth truth;
  Random random(scene.seed);
  const Lens lens = Lens::from_params(1600, 1200, LensModel::opencv,
                                      {2800.0, 2800.0, 807.3, 596.1, -0.08, 0.03, 4e-4, -3e-4});
  // As the product defines the table frame: x along the board's x, origin in the board's plane.
  Rigid3 table_from_board;
  table_from_board.translation = {1.5, -1.1, 0.0};
  for (int camera = 0; camera < 2; ++camera) {
    truth.cameras.push_back(
        {fmt::format("cam{}", camera), 1600, 1200, LensModel::opencv, lens, true});
  }
  for (int pass = 0; pass < scene.passes; ++pass) {
    for (int camera = 0; camera < 2; ++camera) {
      const Rigid3 camera_from_station =
          camera == 0 ? camera_on_ring(15.0, -90.0) : camera_on_ring(45.0, -82.5);
      for (int i = 0; i < scene.views_per_ring; ++i) {
        const double told_deg = 360.0 * i / scene.views_per_ring;
        Rigid3 station_from_table =
            rotation_about_z(told_deg + random.normal(0.0, scene.angle_sd_deg));
        for (int axis = 0; axis < 3; ++axis) {
          station_from_table.translation[axis] = random.normal(0.0, scene.wobble_mm);
        }
        PoseObservation view;
        view.name = fmt::format("images/p{}_c{}_{:03}.png", pass, camera, i);
        view.camera = camera;
        view.pass = pass;
        view.table_angle_deg = told_deg;
        const Rigid3 camera_from_table = camera_from_station * station_from_table;
        const Eigen::Vector3d eye = camera_from_table.inverse().translation;
        for (int id = 0; id < truth.board.corner_count(); ++id) {
          const Eigen::Vector3d x = table_from_board * truth.board.corner(id);
          const Eigen::Vector2d px = lens.project(camera_from_table * x);
          const Eigen::Vector2d noise(random.normal(0.0, scene.noise_px),
                                      random.normal(0.0, scene.noise_px));
          if (hidden(eye, x) || (px.array() < 5.0).any() || px.x() > 1595.0 || px.y() > 1195.0) {
            continue;
          }
          view.corners.push_back({id, px + noise});
        }
        truth.views.push_back(std::move(view));
        truth.camera_from_table.push_back(camera_from_table);
      }
    }
  }
  return truth;
}

double worst_position_mm(const PoseSceneTruth& truth, const PoseResult& result) {
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    if (!result.views[i].used()) continue;
    worst = std::max(worst, (truth.camera_from_table[i].inverse().translation -
                             result.views[i].camera_from_table.inverse().translation)
                                .norm());
  }
  return worst;
}

double worst_rotation_deg(const PoseSceneTruth& truth, const PoseResult& result) {
  double worst = 0.0;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    if (!result.views[i].used()) continue;
    worst = std::max(worst, rotation_distance_deg(truth.camera_from_table[i],
                                                  result.views[i].camera_from_table));
  }
  return worst;
}

double scale_error_percent(const PoseSceneTruth& truth, const PoseResult& result) {
  std::vector<Rigid3> given;
  std::vector<Rigid3> found;
  for (std::size_t i = 0; i < truth.views.size(); ++i) {
    if (!result.views[i].used()) continue;
    given.push_back(truth.camera_from_table[i]);
    found.push_back(result.views[i].camera_from_table);
  }
  return 100.0 * (scale_between(given, found, 1.0).value() - 1.0);
}

}  // namespace skullstation::testing
