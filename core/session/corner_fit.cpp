#include "core/session/corner_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace skullstation {

namespace {

struct Pixel {
  double x = 0.0, y = 0.0;  // px
  double level = 0.0;
};

// The edges' directions turn, the blur and the light are unknown like the position itself.
enum Unknown { at_x, at_y, angle_u, angle_v, log_blur, middle, contrast, slope_x, slope_y, count };
using Unknowns = Eigen::Matrix<double, count, 1>;
using Normal = Eigen::Matrix<double, count, count>;

/// Distance [px] between lines 1 mm apart: x across lines u = const, y across lines v = const.
Eigen::Vector2d line_spacing_px(const Eigen::Matrix2d& px_from_mm) {
  const double area = std::abs(px_from_mm.determinant());
  return {area / px_from_mm.col(1).norm(), area / px_from_mm.col(0).norm()};
}

/// Pixels of the cross around `center`: a strip along each edge, not so wide that it reaches the
/// markers' bits, not longer than the squares.
std::vector<Pixel> cross_pixels(const Image8& grey, const ExpectedCorner& expected,
                                const Eigen::Vector2d& center) {
  const Eigen::Matrix2d& a = expected.px_from_mm;
  const Eigen::Vector2d spacing = line_spacing_px(a);
  Eigen::Vector2d half_width;   // mm, across the edges u = 0 and v = 0
  Eigen::Vector2d half_length;  // mm, along the axes u and v
  for (int axis = 0; axis < 2; ++axis) {
    // The marker's outermost ring is always black: up to its middle the picture is known.
    const double known_px = (expected.free_mm + 0.6 * expected.ring_mm) * spacing[axis];
    half_width[axis] = std::clamp(known_px - 0.5, 2.0, 6.0) / spacing[axis];
    half_width[axis] = std::min(half_width[axis], 0.45 * expected.square_mm);
    half_length[axis] = std::min(0.45 * expected.square_mm, 14.0 / spacing[axis]);
    half_length[axis] = std::max(half_length[axis], half_width[axis]);
  }
  const Eigen::Matrix2d inverse = a.inverse();
  const Eigen::Vector2d reach = a.cwiseAbs() * half_length;
  const int left = std::max(0, static_cast<int>(std::floor(center.x() - reach.x())));
  const int right = std::min(grey.width - 1, static_cast<int>(std::ceil(center.x() + reach.x())));
  const int top = std::max(0, static_cast<int>(std::floor(center.y() - reach.y())));
  const int bottom = std::min(grey.height - 1, static_cast<int>(std::ceil(center.y() + reach.y())));
  std::vector<Pixel> pixels;
  for (int y = top; y <= bottom; ++y) {
    for (int x = left; x <= right; ++x) {
      const Eigen::Vector2d offset = Eigen::Vector2d(x + 0.5, y + 0.5) - center;
      const Eigen::Vector2d uv = (inverse * offset).cwiseAbs();
      const bool along_u = uv.y() <= half_width.y() && uv.x() <= half_length.x();
      const bool along_v = uv.x() <= half_width.x() && uv.y() <= half_length.y();
      if (along_u || along_v) {
        pixels.push_back({x + 0.5, y + 0.5, static_cast<double>(grey.at(x, y))});
      }
    }
  }
  return pixels;
}

/// What the model knows beforehand.
struct Surroundings {
  double sign = 1.0;         ///< white is where the signed distances' product has this sign
  double marker_u_px = 0.0;  ///< from the edge along u to the markers
  double marker_v_px = 0.0;  ///< from the edge along v to the markers
};

/// The picture that one set of unknowns predicts.
class CornerModel {
 public:
  CornerModel(const Surroundings& around, const Unknowns& p)
      : around_(around),
        p_(p),
        cos_u_(std::cos(p[angle_u])),
        sin_u_(std::sin(p[angle_u])),
        cos_v_(std::cos(p[angle_v])),
        sin_v_(std::sin(p[angle_v])),
        inverse_blur_(std::exp(-p[log_blur]) * std::numbers::sqrt2 * 0.5) {}

  double level(double x, double y) const {
    const double dx = x - p_[at_x];
    const double dy = y - p_[at_y];
    const double from_u = distance_from_u(dx, dy);
    const double from_v = distance_from_v(dx, dy);
    double pattern = std::erf(from_u * inverse_blur_) * std::erf(from_v * inverse_blur_);
    for (const double side : {-1.0, 1.0}) {
      const double a = marker_depth_u(side, from_u);
      const double b = marker_depth_v(side, from_v);
      if (a < out_of_reach || b < out_of_reach) continue;
      pattern -= 0.5 * around_.sign * (1.0 + std::erf(a)) * (1.0 + std::erf(b));
    }
    return (p_[middle] + p_[contrast] * pattern) * light(dx, dy);
  }

  /// The level with its derivatives by the unknowns.
  double level(double x, double y, Unknowns& slope) const {
    const double dx = x - p_[at_x];
    const double dy = y - p_[at_y];
    const double from_u = distance_from_u(dx, dy);
    const double from_v = distance_from_v(dx, dy);
    const double edge_u = std::erf(from_u * inverse_blur_);
    const double edge_v = std::erf(from_v * inverse_blur_);
    // Black where squares are black, and where a marker's corner begins in a white one.
    double pattern = edge_u * edge_v;
    double pattern_by_u = edge_v * erf_slope(from_u * inverse_blur_);
    double pattern_by_v = edge_u * erf_slope(from_v * inverse_blur_);
    double pattern_by_margin = 0.0;  // what the blur does by way of the markers' distance
    for (const double side : {-1.0, 1.0}) {
      const double a = marker_depth_u(side, from_u);
      const double b = marker_depth_v(side, from_v);
      if (a < out_of_reach || b < out_of_reach) continue;
      const double in_u = 1.0 + std::erf(a);
      const double in_v = 1.0 + std::erf(b);
      const double by_a = 0.5 * around_.sign * in_v * erf_slope(a);
      const double by_b = 0.5 * around_.sign * in_u * erf_slope(b);
      pattern -= 0.5 * around_.sign * in_u * in_v;
      pattern_by_u -= by_a * side;
      pattern_by_v -= by_b * side * around_.sign;
      pattern_by_margin +=
          inverse_blur_ * (by_a * around_.marker_u_px + by_b * around_.marker_v_px);
    }
    const double paper = p_[middle] + p_[contrast] * pattern;
    const double lit = light(dx, dy);
    const double by_u = lit * p_[contrast] * pattern_by_u * inverse_blur_;
    const double by_v = lit * p_[contrast] * pattern_by_v * inverse_blur_;
    slope[at_x] = by_u * sin_u_ + by_v * sin_v_ - paper * p_[slope_x];
    slope[at_y] = -by_u * cos_u_ - by_v * cos_v_ - paper * p_[slope_y];
    slope[angle_u] = -by_u * (sin_u_ * dy + cos_u_ * dx);
    slope[angle_v] = -by_v * (sin_v_ * dy + cos_v_ * dx);
    slope[log_blur] = -by_u * from_u - by_v * from_v - lit * p_[contrast] * pattern_by_margin;
    slope[middle] = lit;
    slope[contrast] = lit * pattern;
    slope[slope_x] = paper * dx;
    slope[slope_y] = paper * dy;
    return paper * lit;
  }

 private:
  /// Where 1 + erf is nothing.
  static constexpr double out_of_reach = -4.0;

  static double erf_slope(double x) { return 2.0 * std::numbers::inv_sqrtpi * std::exp(-x * x); }
  double light(double dx, double dy) const { return 1.0 + p_[slope_x] * dx + p_[slope_y] * dy; }
  // Signed distances [px] from the edges along u and along v.
  double distance_from_u(double dx, double dy) const { return cos_u_ * dy - sin_u_ * dx; }
  double distance_from_v(double dx, double dy) const { return cos_v_ * dy - sin_v_ * dx; }
  // How far inside the marker, in units of the blur: of the white square on one side of the edge
  // along u or on the other. There the signed distances have the product's sign.
  double marker_depth_u(double side, double from_u) const {
    return (side * from_u - around_.marker_u_px) * inverse_blur_;
  }
  double marker_depth_v(double side, double from_v) const {
    return (side * around_.sign * from_v - around_.marker_v_px) * inverse_blur_;
  }

  const Surroundings around_;
  const Unknowns p_;
  const double cos_u_, sin_u_, cos_v_, sin_v_;
  const double inverse_blur_;
};

double squared_error(const Surroundings& around, const std::vector<Pixel>& pixels,
                     const Unknowns& p) {
  const CornerModel model(around, p);
  double sum = 0.0;
  for (const Pixel& pixel : pixels) {
    const double error = model.level(pixel.x, pixel.y) - pixel.level;
    sum += error * error;
  }
  return sum;
}

/// Levenberg-Marquardt (Marquardt 1963), given up where the position runs off by more than
/// `max_shift_px`; returns the squared error reached.
double minimise(const Surroundings& around, const std::vector<Pixel>& pixels, double max_shift_px,
                Unknowns& p) {
  constexpr int max_iterations = 30;
  constexpr double converged_px = 1e-3;
  const Eigen::Vector2d start = p.head<2>();
  double error = squared_error(around, pixels, p);
  double damping = 1e-3;
  for (int iteration = 0; iteration < max_iterations; ++iteration) {
    Normal normal = Normal::Zero();
    Unknowns gradient = Unknowns::Zero();
    Unknowns slope;
    const CornerModel model(around, p);
    for (const Pixel& pixel : pixels) {
      const double residual = model.level(pixel.x, pixel.y, slope) - pixel.level;
      normal.selfadjointView<Eigen::Lower>().rankUpdate(slope);
      gradient += residual * slope;
    }
    bool improved = false;
    double step_px = 0.0;
    while (!improved && damping < 1e6) {
      Normal damped = normal;
      damped.diagonal() += damping * (normal.diagonal().array() + 1e-9).matrix();
      const Unknowns step = -damped.selfadjointView<Eigen::Lower>().ldlt().solve(gradient);
      const Unknowns next = p + step;
      const double next_error = squared_error(around, pixels, next);
      if (next_error <= error) {
        step_px = step.head<2>().norm();
        p = next;
        error = next_error;
        damping = std::max(1e-9, damping * 0.1);
        improved = true;
      } else {
        damping *= 10.0;
      }
    }
    if (!improved || step_px < converged_px) break;
    if (!((p.head<2>() - start).norm() <= 2.0 * max_shift_px)) break;
  }
  return error;
}

double angle_between(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * std::numbers::pi));
}

}  // namespace

std::optional<FittedCorner> fit_corner(const Image8& grey, const ExpectedCorner& expected) {
  // Fewer pixels than this (a corner at the image's rim) don't determine nine unknowns well.
  constexpr std::size_t min_pixels = 30;
  constexpr double min_contrast = 5.0;     // grey levels, half the step from black to white
  constexpr double max_unexplained = 0.2;  // of the pixels' variance
  constexpr double max_turn = 0.35;        // radians, against the expected edges

  const Eigen::Matrix2d& a = expected.px_from_mm;
  const double expected_u = std::atan2(a(1, 0), a(0, 0));
  const double expected_v = std::atan2(a(1, 1), a(0, 1));
  // The first quadrant lies to the left of one edge's direction and to the right of the other's,
  // so there the two signed distances have opposite signs.
  const double sign = expected.first_quadrant_white ? -1.0 : 1.0;
  const Eigen::Vector2d marker_px = expected.free_mm * line_spacing_px(a);
  const Surroundings around{sign, marker_px.y(), marker_px.x()};

  Unknowns p = Unknowns::Zero();
  p[at_x] = expected.position_px.x();
  p[at_y] = expected.position_px.y();
  p[angle_u] = expected_u;
  p[angle_v] = expected_v;
  p[log_blur] = std::log(1.0);
  double unexplained = 0.0;
  for (int pass = 0; pass < 2; ++pass) {
    const std::vector<Pixel> pixels = cross_pixels(grey, expected, p.head<2>());
    if (pixels.size() < min_pixels) return std::nullopt;
    double mean = 0.0;
    for (const Pixel& pixel : pixels) mean += pixel.level;
    mean /= static_cast<double>(pixels.size());
    double variance = 0.0;
    for (const Pixel& pixel : pixels) {
      variance += (pixel.level - mean) * (pixel.level - mean);
    }
    if (pass == 0) {
      p[middle] = mean;
      p[contrast] = sign * std::sqrt(variance / static_cast<double>(pixels.size()));
    }
    const double error = minimise(around, pixels, expected.max_shift_px, p);
    const double shift = (p.head<2>() - expected.position_px).norm();
    // Negated comparisons also catch what is not a number.
    if (!(shift <= expected.max_shift_px)) return std::nullopt;
    if (!(sign * p[contrast] >= min_contrast)) return std::nullopt;
    unexplained = error / variance;
    if (!(unexplained <= max_unexplained)) return std::nullopt;
    if (angle_between(p[angle_u], expected_u) > max_turn) return std::nullopt;
    if (angle_between(p[angle_v], expected_v) > max_turn) return std::nullopt;
    const double square_px = expected.square_mm * std::sqrt(std::abs(a.determinant()));
    if (!(std::exp(p[log_blur]) < 0.25 * square_px)) return std::nullopt;
  }
  return FittedCorner{p.head<2>(), unexplained};
}

}  // namespace skullstation
