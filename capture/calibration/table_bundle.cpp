#include "capture/calibration/table_bundle.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Geometry>
#include <cmath>

#include "core/adjustment/bundle_solver.h"
#include "core/adjustment/reprojection.h"
#include "core/units.h"

namespace skullstation {

namespace {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

template <class T>
void pixel_residual(const Lens& lens, const Vector3<T>& x_camera, const Eigen::Vector2d& observed,
                    T* residual) {
  const T intrinsics[8] = {T(lens.fx), T(lens.fy), T(lens.cx), T(lens.cy),
                           T(lens.k1), T(lens.k2), T(lens.p1), T(lens.p2)};
  const Eigen::Matrix<T, 2, 1> px = project_opencv<T>(intrinsics, x_camera);
  residual[0] = px.x() - observed.x();
  residual[1] = px.y() - observed.y();
}

struct TableResidual {
  Eigen::Vector3d x_board;
  Eigen::Vector2d observed_px;
  const Lens& lens;

  template <class T>
  bool operator()(const T* axis, const T* angle_rad, const T* rotation, const T* translation,
                  T* residual) const {
    const Vector3<T> x_table = board_point_on_table<T>(axis, x_board.template cast<T>());
    const Vector3<T> x_station = turned<T>(*angle_rad, x_table);
    pixel_residual<T>(lens, transformed<T>(rotation, translation, x_station), observed_px,
                      residual);
    return true;
  }
};

struct DepartureResidual {
  Eigen::Vector3d x_station;
  Eigen::Vector2d observed_px;
  const Lens& lens;
  const Rigid3& camera_from_station;

  template <class T>
  bool operator()(const T* motion, T* residual) const {
    const Vector3<T> x = x_station.template cast<T>();
    Vector3<T> moved;
    ceres::AngleAxisRotatePoint(motion, x.data(), moved.data());
    moved += Vector3<T>(motion[3], motion[4], motion[5]);
    const Vector3<T> x_camera =
        camera_from_station.rotation.cast<T>() * moved + camera_from_station.translation.cast<T>();
    pixel_residual<T>(lens, x_camera, observed_px, residual);
    return true;
  }
};

}  // namespace

std::optional<TableState> first_table_state(const std::vector<TableObservation>& observations,
                                            const std::vector<Rigid3>& camera_from_board,
                                            int cameras, int stops, double min_turn_deg) {
  std::vector<Rigid3> motions;
  std::vector<int> first_of_camera(static_cast<std::size_t>(cameras), -1);
  for (std::size_t i = 0; i < observations.size(); ++i) {
    int& first = first_of_camera[static_cast<std::size_t>(observations[i].camera)];
    if (first < 0) {
      first = static_cast<int>(i);
    } else {
      motions.push_back(camera_from_board[static_cast<std::size_t>(first)].inverse() *
                        camera_from_board[i]);
    }
  }
  const auto axis = axis_of_motions(motions, min_turn_deg);
  if (!axis) return std::nullopt;
  TableState state;
  state.axis = *axis;
  const Rigid3 board_from_table = axis->table_from_board().inverse();
  // From the first observation on: a known angle places the cameras that saw it, a placed camera
  // tells the angles of all its stops.
  std::vector<std::optional<double>> angles(static_cast<std::size_t>(stops));
  std::vector<std::optional<Rigid3>> placements(static_cast<std::size_t>(cameras));
  angles[static_cast<std::size_t>(observations.front().stop)] = 0.0;
  for (bool added = true; added;) {
    added = false;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      auto& angle = angles[static_cast<std::size_t>(observations[i].stop)];
      auto& placement = placements[static_cast<std::size_t>(observations[i].camera)];
      const Rigid3 camera_from_table = camera_from_board[i] * board_from_table;
      if (angle && !placement) {
        placement = camera_from_table * rotation_about_z(-degrees(*angle));
        added = true;
      } else if (!angle && placement) {
        const Eigen::Quaterniond turn = (placement->inverse() * camera_from_table).rotation;
        angle = 2.0 * std::atan2(turn.z(), turn.w());
        added = true;
      }
    }
  }
  for (const auto& angle : angles) {
    if (!angle) return std::nullopt;
    state.angles_rad.push_back(*angle);
  }
  for (const auto& placement : placements) {
    if (!placement) return std::nullopt;
    state.camera_from_station.push_back(*placement);
  }
  return state;
}

std::optional<TableCovariance> adjust_table(const std::vector<TableObservation>& observations,
                                            const std::vector<Lens>& lenses,
                                            const CharucoBoard& board, bool robust,
                                            TableState& state) {
  ceres::Problem problem;
  double* const axis = state.axis.unknowns.data();
  for (Rigid3& camera : state.camera_from_station) {
    problem.AddParameterBlock(camera.rotation.coeffs().data(), 4,
                              new ceres::EigenQuaternionManifold);
  }
  for (const TableObservation& seen : observations) {
    const auto camera = static_cast<std::size_t>(seen.camera);
    for (const BoardCorner& corner : seen.corners) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<TableResidual, 2, 4, 1, 4, 3>(
              new TableResidual{board.corner(corner.id), corner.position_px, lenses[camera]}),
          robust ? new ceres::HuberLoss(1.0) : nullptr, axis,
          &state.angles_rad[static_cast<std::size_t>(seen.stop)],
          state.camera_from_station[camera].rotation.coeffs().data(),
          state.camera_from_station[camera].translation.data());
    }
  }
  // Turning all angles and all cameras together changes nothing.
  problem.SetParameterBlockConstant(state.angles_rad.data());
  if (!solve_bundle(problem)) return std::nullopt;
  std::vector<double*> blocks = {axis};
  for (std::size_t i = 1; i < state.angles_rad.size(); ++i) blocks.push_back(&state.angles_rad[i]);
  for (Rigid3& camera : state.camera_from_station) {
    blocks.push_back(camera.rotation.coeffs().data());
    blocks.push_back(camera.translation.data());
  }
  const Eigen::MatrixXd covariance = bundle_covariance(problem, blocks, 4);
  if (covariance.size() == 0) return std::nullopt;
  return TableCovariance{covariance};
}

Eigen::Vector2d project_corner(const TableState& state, const std::vector<Lens>& lenses,
                               const TableObservation& observation,
                               const Eigen::Vector3d& x_board) {
  const auto camera = static_cast<std::size_t>(observation.camera);
  const Eigen::Vector3d x_station =
      turned<double>(state.angles_rad[static_cast<std::size_t>(observation.stop)],
                     board_point_on_table<double>(state.axis.unknowns.data(), x_board));
  return lenses[camera].project(state.camera_from_station[camera] * x_station);
}

std::optional<StopDeparture> departure_of_stop(const std::vector<TableObservation>& observations,
                                               const std::vector<Lens>& lenses,
                                               const CharucoBoard& board, const TableState& state,
                                               int stop) {
  StopDeparture departure;
  departure.motion.setZero();
  const double angle_rad = state.angles_rad[static_cast<std::size_t>(stop)];
  ceres::Problem problem;
  for (const TableObservation& seen : observations) {
    if (seen.stop != stop) continue;
    const auto camera = static_cast<std::size_t>(seen.camera);
    for (const BoardCorner& corner : seen.corners) {
      const Eigen::Vector3d x_station = turned<double>(
          angle_rad,
          board_point_on_table<double>(state.axis.unknowns.data(), board.corner(corner.id)));
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<DepartureResidual, 2, 6>(new DepartureResidual{
              x_station, corner.position_px, lenses[camera], state.camera_from_station[camera]}),
          nullptr, departure.motion.data());
      ++departure.corners;
    }
  }
  if (departure.corners == 0 || !solve_bundle(problem)) return std::nullopt;
  double half_squares = 0.0;
  problem.Evaluate(ceres::Problem::EvaluateOptions(), &half_squares, nullptr, nullptr, nullptr);
  departure.squared_error_px2 = 2.0 * half_squares;
  const Eigen::MatrixXd covariance = bundle_covariance(problem, {departure.motion.data()}, 6);
  if (covariance.size() == 0) return std::nullopt;
  departure.covariance = covariance;
  return departure;
}

}  // namespace skullstation
