#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/adjustment/table_axis.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// The corners that one camera saw at one stop.
struct TableObservation {
  int camera = 0;
  int stop = 0;
  std::vector<BoardCorner> corners;
};

/// All unknowns of the table calibration.
struct TableState {
  TableAxis axis;
  std::vector<double> angles_rad;           ///< per stop
  std::vector<Rigid3> camera_from_station;  ///< per camera
};

/// Start values from the pose of the board in each observation: its motion from stop to stop turns
/// about the axis. Nothing if some camera shares no stop with the others, or the board nowhere
/// turned by as much as `min_turn_deg`.
std::optional<TableState> first_table_state(const std::vector<TableObservation>& observations,
                                            const std::vector<Rigid3>& camera_from_board,
                                            int cameras, int stops, double min_turn_deg);

struct TableCovariance {
  Eigen::Matrix4d axis;  ///< of TableAxis::unknowns
};

/// Bundle adjustment over axis, angles (the first one fixed) and camera placements. `robust`:
/// Huber loss of 1 px. Returns the axis's covariance for unit variance of the corners if it is
/// determined and asked for; nothing if no solution was found.
std::optional<TableCovariance> adjust_table(const std::vector<TableObservation>& observations,
                                            const std::vector<Lens>& lenses,
                                            const CharucoBoard& board, bool robust,
                                            TableState& state);

/// Image point of a board corner.
Eigen::Vector2d project_corner(const TableState& state, const std::vector<Lens>& lenses,
                               const TableObservation& observation, const Eigen::Vector3d& x_board);

/// How one stop departs from a pure rotation: the board's own motion, free in all six directions,
/// against the adjusted model.
struct StopDeparture {
  Eigen::Matrix<double, 6, 1> motion;      ///< rotation vector [rad] and translation [mm], station
  Eigen::Matrix<double, 6, 6> covariance;  ///< for unit variance of the corners
  double squared_error_px2 = 0.0;          ///< of the corners after it
  int corners = 0;
};
std::optional<StopDeparture> departure_of_stop(const std::vector<TableObservation>& observations,
                                               const std::vector<Lens>& lenses,
                                               const CharucoBoard& board, const TableState& state,
                                               int stop);

}  // namespace skullstation
