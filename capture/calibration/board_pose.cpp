#include "capture/calibration/board_pose.h"

#include <ceres/ceres.h>

#include <cmath>
#include <opencv2/calib3d.hpp>

#include "core/adjustment/bundle_solver.h"
#include "core/adjustment/reprojection.h"

namespace skullstation {

namespace {

/// Reprojection of one corner through a known lens.
struct PoseResidual {
  Eigen::Vector3d x_board;
  Eigen::Vector2d observed_px;
  const Lens& lens;

  template <class T>
  bool operator()(const T* rotation, const T* translation, T* residual) const {
    const Eigen::Matrix<T, 3, 1> x =
        transformed<T>(rotation, translation, x_board.template cast<T>());
    const T intrinsics[8] = {T(lens.fx), T(lens.fy), T(lens.cx), T(lens.cy),
                             T(lens.k1), T(lens.k2), T(lens.p1), T(lens.p2)};
    const Eigen::Matrix<T, 2, 1> px = project_opencv<T>(intrinsics, x);
    residual[0] = px.x() - observed_px.x();
    residual[1] = px.y() - observed_px.y();
    return true;
  }
};

bool refine(const std::vector<BoardCorner>& corners, const CharucoBoard& board, const Lens& lens,
            Rigid3& pose) {
  ceres::Problem problem;
  double* const rotation = pose.rotation.coeffs().data();
  double* const translation = pose.translation.data();
  problem.AddParameterBlock(rotation, 4, new ceres::EigenQuaternionManifold);
  for (const BoardCorner& corner : corners) {
    problem.AddResidualBlock(
        new ceres::AutoDiffCostFunction<PoseResidual, 2, 4, 3>(
            new PoseResidual{board.corner(corner.id), corner.position_px, lens}),
        new ceres::HuberLoss(1.0), rotation, translation);
  }
  return solve_bundle(problem);
}

/// Both poses that a plane allows, unrefined.
std::vector<Rigid3> planar_poses(const std::vector<BoardCorner>& corners, const CharucoBoard& board,
                                 const Lens& lens) {
  std::vector<cv::Point3d> board_points;
  std::vector<cv::Point2d> rays;  // undistorted, focal length 1
  for (const BoardCorner& corner : corners) {
    const auto ray = lens.ray(corner.position_px);
    if (!ray) continue;
    const Eigen::Vector3d x = board.corner(corner.id);
    board_points.emplace_back(x.x(), x.y(), 0.0);
    rays.emplace_back(ray->x(), ray->y());
  }
  if (rays.size() < 6) return {};
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  const double count = static_cast<double>(board_points.size());
  for (const auto& p : board_points) mean += Eigen::Vector2d(p.x, p.y) / count;
  for (const auto& p : board_points) {
    const Eigen::Vector2d d = Eigen::Vector2d(p.x, p.y) - mean;
    spread += d * d.transpose() / count;
  }
  const double square2 = board.square_mm * board.square_mm;
  if (spread.determinant() < 0.01 * square2 * square2) return {};  // a single row

  std::vector<cv::Mat> rotations;
  std::vector<cv::Mat> translations;
  try {
    cv::solvePnPGeneric(board_points, rays, cv::Mat::eye(3, 3, CV_64F), cv::noArray(), rotations,
                        translations, false, cv::SOLVEPNP_IPPE);
  } catch (const cv::Exception&) {
    return {};  // degenerate points
  }
  std::vector<Rigid3> poses;
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    const Eigen::Map<const Eigen::Vector3d> r(rotations[i].ptr<double>());
    const Eigen::Map<const Eigen::Vector3d> t(translations[i].ptr<double>());
    if (!r.allFinite() || !t.allFinite() || !(t.z() > 0.0)) continue;
    Rigid3 pose{Eigen::Quaterniond::Identity(), t};
    if (r.norm() > 0.0) pose.rotation = Eigen::AngleAxisd(r.norm(), r.normalized());
    poses.push_back(pose);
  }
  return poses;
}

std::optional<BoardPose> better_pose(const std::vector<BoardCorner>& corners,
                                     const CharucoBoard& board, const Lens& lens, bool refined) {
  std::optional<BoardPose> best;
  for (Rigid3 pose : planar_poses(corners, board, lens)) {
    if (refined && !refine(corners, board, lens, pose)) continue;
    const double rms_px = reprojection_rms_px(corners, board, lens, pose);
    if (std::isfinite(rms_px) && (!best || rms_px < best->rms_px)) best = BoardPose{pose, rms_px};
  }
  return best;
}

}  // namespace

double reprojection_rms_px(const std::vector<BoardCorner>& corners, const CharucoBoard& board,
                           const Lens& lens, const Rigid3& camera_from_board) {
  double sum = 0.0;
  for (const BoardCorner& corner : corners) {
    const Eigen::Vector3d x = camera_from_board * board.corner(corner.id);
    sum += (lens.project(x) - corner.position_px).squaredNorm();
  }
  return corners.empty() ? 0.0 : std::sqrt(sum / static_cast<double>(corners.size()));
}

std::optional<BoardPose> rough_board_pose(const std::vector<BoardCorner>& corners,
                                          const CharucoBoard& board, const Lens& lens) {
  return better_pose(corners, board, lens, false);
}

std::optional<BoardPose> estimate_board_pose(const std::vector<BoardCorner>& corners,
                                             const CharucoBoard& board, const Lens& lens) {
  return better_pose(corners, board, lens, true);
}

}  // namespace skullstation
