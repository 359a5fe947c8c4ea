#include "core/session/board_homography.h"

#include <Eigen/LU>
#include <Eigen/QR>
#include <cmath>

#include "core/linear_algebra.h"

namespace skullstation {

std::optional<Homography> fit_homography(const Correspondences& points) {
  const auto count = static_cast<Eigen::Index>(points.board_mm.size());
  if (count < 3) return std::nullopt;
  Homography h;
  Eigen::Vector2d image_center = Eigen::Vector2d::Zero();
  h.origin_mm.setZero();
  for (Eigen::Index i = 0; i < count; ++i) {
    h.origin_mm += points.board_mm[i] / static_cast<double>(count);
    image_center += points.image_px[i] / static_cast<double>(count);
  }
  Eigen::Matrix2d spread = Eigen::Matrix2d::Zero();
  double image_scale = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector2d mm = points.board_mm[i] - h.origin_mm;
    spread += mm * mm.transpose() / static_cast<double>(count);
    image_scale += (points.image_px[i] - image_center).norm() / static_cast<double>(count);
  }
  h.scale_mm = std::sqrt(spread.trace());
  if (!(spread.determinant() > 1e-4 * h.scale_mm * h.scale_mm * h.scale_mm * h.scale_mm)) {
    return std::nullopt;
  }
  if (!(image_scale > 0.0)) return std::nullopt;

  Eigen::Matrix3d fitted;
  if (count < 6) {
    Eigen::MatrixXd a(count, 3);
    Eigen::MatrixXd b(count, 2);
    for (Eigen::Index i = 0; i < count; ++i) {
      a.row(i) = ((points.board_mm[i] - h.origin_mm) / h.scale_mm).homogeneous().transpose();
      b.row(i) = ((points.image_px[i] - image_center) / image_scale).transpose();
    }
    fitted.topRows<2>() = a.colPivHouseholderQr().solve(b).transpose();
    fitted.row(2) = Eigen::RowVector3d::UnitZ();
  } else {
    Eigen::Matrix<double, 9, 9> normal = Eigen::Matrix<double, 9, 9>::Zero();
    for (Eigen::Index i = 0; i < count; ++i) {
      const Eigen::Vector3d x = ((points.board_mm[i] - h.origin_mm) / h.scale_mm).homogeneous();
      const Eigen::Vector2d px = (points.image_px[i] - image_center) / image_scale;
      Eigen::Matrix<double, 2, 9> rows = Eigen::Matrix<double, 2, 9>::Zero();
      rows.block<1, 3>(0, 0) = x.transpose();
      rows.block<1, 3>(0, 6) = -px.x() * x.transpose();
      rows.block<1, 3>(1, 3) = x.transpose();
      rows.block<1, 3>(1, 6) = -px.y() * x.transpose();
      normal += rows.transpose() * rows;
    }
    const SymmetricSpectrum solver = symmetric_spectrum(normal);
    const Eigen::Matrix<double, 9, 1> v = solver.vectors.col(0);
    fitted << v.segment<3>(0).transpose(), v.segment<3>(3).transpose(), v.segment<3>(6).transpose();
  }
  Eigen::Matrix3d denormalise;
  denormalise << image_scale, 0.0, image_center.x(), 0.0, image_scale, image_center.y(), 0.0, 0.0,
      1.0;
  h.matrix = denormalise * fitted;
  return h;
}

}  // namespace skullstation
