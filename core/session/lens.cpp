#include "core/session/lens.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

namespace skullstation {

namespace {

struct Distorted {
  Eigen::Vector2d point;
  Eigen::Matrix2d jacobian;
};

/// The model of Brown (1971) in the form of COLMAP's OPENCV camera, with its derivative.
Distorted distort(const Lens& lens, const Eigen::Vector2d& undistorted) {
  const double x = undistorted.x();
  const double y = undistorted.y();
  const double r2 = x * x + y * y;
  const double radial = 1.0 + r2 * (lens.k1 + r2 * lens.k2);
  const double radial_slope = 2.0 * (lens.k1 + 2.0 * lens.k2 * r2);  // d radial / d r2, twice
  Distorted d;
  d.point = {x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
             y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y};
  const double mixed = radial_slope * x * y + 2.0 * lens.p1 * x + 2.0 * lens.p2 * y;
  d.jacobian << radial + radial_slope * x * x + 2.0 * lens.p1 * y + 6.0 * lens.p2 * x, mixed, mixed,
      radial + radial_slope * y * y + 6.0 * lens.p1 * y + 2.0 * lens.p2 * x;
  return d;
}

/// Squared radius at which the radial distortion stops growing: the smallest positive root of
/// d/dr r (1 + k1 r^2 + k2 r^4) = 1 + 3 k1 s + 5 k2 s^2, s = r^2.
double fold_squared_radius(const Lens& lens) {
  constexpr double never = std::numeric_limits<double>::infinity();
  const double a = 5.0 * lens.k2;
  const double b = 3.0 * lens.k1;
  if (a == 0.0) return b < 0.0 ? -1.0 / b : never;
  const double discriminant = b * b - 4.0 * a;
  if (discriminant < 0.0) return never;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  double smallest = never;
  for (const double root : {q / a, 1.0 / q}) {
    if (root > 0.0 && root < smallest) smallest = root;
  }
  return smallest;
}

/// The radius below the fold whose radial distortion gives `distorted`, by Newton's method kept
/// inside a shrinking bracket; nothing if the lens reaches no such radius.
std::optional<double> undistort_radius(const Lens& lens, double distorted, double fold) {
  const auto radius_of = [&](double r) {
    const double s = r * r;
    return r * (1.0 + s * (lens.k1 + s * lens.k2));
  };
  double low = 0.0;
  double high = fold;
  if (std::isinf(fold)) {
    high = std::max(1.0, distorted);
    // Without a fold the distorted radius grows without bound, so this ends.
    while (radius_of(high) < distorted) high *= 2.0;
  } else if (radius_of(fold) <= distorted) {
    return std::nullopt;
  }
  double r = std::min(distorted, 0.5 * (low + high));
  for (int i = 0; i < 100; ++i) {
    const double error = radius_of(r) - distorted;
    (error > 0.0 ? high : low) = r;
    const double s = r * r;
    double next = r - error / (1.0 + s * (3.0 * lens.k1 + 5.0 * s * lens.k2));
    if (!(next > low && next < high)) next = 0.5 * (low + high);
    if (std::abs(next - r) <= 1e-12 * (1.0 + r)) return next;
    r = next;
  }
  return r;
}

}  // namespace

std::string to_string(LensModel model) {
  return model == LensModel::pinhole ? "PINHOLE" : "OPENCV";
}

Result<LensModel> lens_model_from_string(const std::string& name) {
  if (name == "PINHOLE") return LensModel::pinhole;
  if (name == "OPENCV") return LensModel::opencv;
  return fail(ErrorKind::bad_input, "camera model", "\"" + name + "\" is not known",
              "use PINHOLE (fx fy cx cy) or OPENCV (fx fy cx cy k1 k2 p1 p2)");
}

int parameter_count(LensModel model) { return model == LensModel::pinhole ? 4 : 8; }

Lens Lens::from_params(int width, int height, LensModel model, const std::vector<double>& params) {
  if (std::cmp_not_equal(params.size(), parameter_count(model))) {
    throw std::invalid_argument("Lens::from_params: wrong number of parameters");
  }
  Lens lens;
  lens.width = width;
  lens.height = height;
  lens.fx = params[0];
  lens.fy = params[1];
  lens.cx = params[2];
  lens.cy = params[3];
  if (model == LensModel::opencv) {
    lens.k1 = params[4];
    lens.k2 = params[5];
    lens.p1 = params[6];
    lens.p2 = params[7];
  }
  return lens;
}

std::vector<double> Lens::params(LensModel model) const {
  if (model == LensModel::opencv) return {fx, fy, cx, cy, k1, k2, p1, p2};
  if (k1 != 0.0 || k2 != 0.0 || p1 != 0.0 || p2 != 0.0) {
    throw std::invalid_argument("Lens::params: PINHOLE can't hold this lens's distortion");
  }
  return {fx, fy, cx, cy};
}

Eigen::Vector2d Lens::project(const Eigen::Vector3d& x_camera) const {
  const Eigen::Vector2d point = distort(*this, x_camera.hnormalized()).point;
  return {fx * point.x() + cx, fy * point.y() + cy};
}

Eigen::Matrix<double, 2, 3> Lens::project_derivative(const Eigen::Vector3d& x_camera) const {
  const Eigen::Vector2d point = x_camera.hnormalized();
  Eigen::Matrix<double, 2, 3> by_point;
  by_point << 1.0, 0.0, -point.x(), 0.0, 1.0, -point.y();
  return Eigen::Vector2d(fx, fy).asDiagonal() * distort(*this, point).jacobian * by_point /
         x_camera.z();
}

std::optional<Eigen::Vector3d> Lens::ray(const Eigen::Vector2d& x_px) const {
  const Eigen::Vector2d distorted((x_px.x() - cx) / fx, (x_px.y() - cy) / fy);
  const double fold2 = fold_squared_radius(*this);
  const double distorted_radius = distorted.norm();
  const auto radius = undistort_radius(*this, distorted_radius, std::sqrt(fold2));
  if (!radius) return std::nullopt;
  Eigen::Vector2d point = distorted;
  if (distorted_radius > 0.0) point *= *radius / distorted_radius;
  // The radial part is undone; what the tangential part adds is small and Newton's domain.
  for (int i = 0; i < 20; ++i) {
    const Distorted at = distort(*this, point);
    if (at.jacobian.determinant() <= 0.0) return std::nullopt;
    const Eigen::Vector2d step = at.jacobian.inverse() * (distorted - at.point);
    point += step;
    if (!(point.squaredNorm() < fold2)) return std::nullopt;
    if (step.norm() <= 1e-10 * (1.0 + point.norm())) {
      return Eigen::Vector3d(point.x(), point.y(), 1.0);
    }
  }
  return std::nullopt;
}

}  // namespace skullstation
