#include "core/session/board_pose.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/root_mean_square.h"
#include "core/session/board_homography.h"

namespace skullstation {

namespace {

constexpr int least_corners = 6;

using Matrix26 = Eigen::Matrix<double, 2, 6>;

Eigen::Matrix3d cross_matrix(const Eigen::Vector3d& v) {
  Eigen::Matrix3d m;
  m << 0.0, -v.z(), v.y(), v.z(), 0.0, -v.x(), -v.y(), v.x(), 0.0;
  return m;
}

/// Nothing if the board would come to lie behind the camera.
std::optional<BoardPose> refined(const std::vector<BoardCorner>& corners, const CharucoBoard& board,
                                 const Lens& lens, Rigid3 pose) {
  constexpr int most_steps = 50;
  constexpr double huber_px = 1.0;
  for (int iteration = 0; iteration < most_steps; ++iteration) {
    Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
    for (const BoardCorner& corner : corners) {
      const Eigen::Vector3d turned = pose.rotation * board.corner(corner.id);
      const Eigen::Vector3d x = turned + pose.translation;
      if (!(x.z() > board.square_mm)) return std::nullopt;
      const Eigen::Vector2d error = corner.position_px - lens.project(x);
      Matrix26 by_pose;
      const Eigen::Matrix<double, 2, 3> by_point = lens.project_derivative(x);
      by_pose << -by_point * cross_matrix(turned), by_point;
      const double weight = std::min(1.0, huber_px / std::max(error.norm(), 1e-12));
      normal += weight * by_pose.transpose() * by_pose;
      right += weight * by_pose.transpose() * error;
    }
    // Rotations are in radians, translations in mm: a unit diagonal makes rank visible.
    const Eigen::Matrix<double, 6, 1> scale = normal.diagonal().cwiseSqrt().cwiseInverse();
    if (!scale.allFinite()) return std::nullopt;
    const Eigen::Matrix<double, 6, 1> step =
        scale.asDiagonal() *
        Eigen::LDLT<Eigen::Matrix<double, 6, 6>>(scale.asDiagonal() * normal * scale.asDiagonal())
            .solve(scale.asDiagonal() * right);
    if (!step.allFinite()) return std::nullopt;
    const double angle = step.head<3>().norm();
    if (angle > 0.0) {
      // A long step from a poor start is cut: it would only swing past.
      const double turn = std::min(angle, 0.3);
      pose.rotation =
          (Eigen::AngleAxisd(turn, step.head<3>() / angle) * pose.rotation).normalized();
    }
    pose.translation += step.tail<3>();
    if (angle < 1e-10 && step.tail<3>().norm() < 1e-8) break;
  }
  const double rms_px = root_mean_square(corner_errors_px(corners, board, lens, pose));
  if (!std::isfinite(rms_px)) return std::nullopt;
  return BoardPose{pose, rms_px};
}

/// The pose whose first two columns and translation the homography of the board's plane holds.
std::optional<Rigid3> homography_pose(const std::vector<BoardCorner>& corners,
                                      const CharucoBoard& board, const Lens& lens) {
  Correspondences points;
  for (const BoardCorner& corner : corners) {
    const auto ray = lens.ray(corner.position_px);
    if (!ray) continue;
    points.board_mm.emplace_back(board.corner(corner.id).head<2>());
    points.image_px.emplace_back(ray->head<2>());
  }
  if (points.board_mm.size() < least_corners) return std::nullopt;
  const auto map = fit_homography(points);
  if (!map) return std::nullopt;
  Eigen::Matrix3d by_mm = map->matrix;
  by_mm.leftCols<2>() /= map->scale_mm;
  by_mm.col(2) -= by_mm.leftCols<2>() * map->origin_mm;
  const double size = std::sqrt(by_mm.col(0).norm() * by_mm.col(1).norm());
  if (!(size > 0.0)) return std::nullopt;
  by_mm /= by_mm(2, 2) < 0.0 ? -size : size;
  Eigen::Matrix3d axes;
  axes << by_mm.col(0), by_mm.col(1), by_mm.col(0).cross(by_mm.col(1));
  const SingularValues3 svd = singular_values(axes);
  const Eigen::Matrix3d rotation = svd.u * svd.v.transpose();
  if (!rotation.allFinite() || rotation.determinant() < 0.5) return std::nullopt;
  return Rigid3{Eigen::Quaterniond(rotation).normalized(), by_mm.col(2)};
}

/// The board's plane mirrored about the line of sight to the middle of what is seen of it.
Rigid3 mirrored(const Rigid3& pose, const Eigen::Vector3d& middle_board) {
  const Eigen::Vector3d middle = pose * middle_board;
  const Eigen::AngleAxisd half_turn(M_PI, middle.normalized());
  // Turning the normal half round the line of sight, and the board half round its normal.
  const Eigen::Quaterniond in_plane(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitZ()));
  Rigid3 other;
  other.rotation = (Eigen::Quaterniond(half_turn) * pose.rotation * in_plane).normalized();
  other.translation = middle - other.rotation * middle_board;
  return other;
}

}  // namespace

std::vector<double> corner_errors_px(const std::vector<BoardCorner>& corners,
                                     const CharucoBoard& board, const Lens& lens,
                                     const Rigid3& camera_from_board) {
  std::vector<double> errors;
  errors.reserve(corners.size());
  for (const BoardCorner& corner : corners) {
    const Eigen::Vector3d x = camera_from_board * board.corner(corner.id);
    errors.push_back((lens.project(x) - corner.position_px).norm());
  }
  return errors;
}

std::optional<BoardPose> find_board_pose(const std::vector<BoardCorner>& corners,
                                         const CharucoBoard& board, const Lens& lens) {
  const auto start = homography_pose(corners, board, lens);
  if (!start) return std::nullopt;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const BoardCorner& corner : corners) {
    middle += board.corner(corner.id) / static_cast<double>(corners.size());
  }
  std::optional<BoardPose> best;
  for (const Rigid3& pose : {*start, mirrored(*start, middle)}) {
    const auto view = refined(corners, board, lens, pose);
    if (view && (!best || view->rms_px < best->rms_px)) best = view;
  }
  return best;
}

}  // namespace skullstation
