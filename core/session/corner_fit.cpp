#include "core/session/corner_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Dense>
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

/// The model's level at a pixel and its derivatives.
double model(const Surroundings& around, const Unknowns& p, double x, double y, Unknowns& slope) {
  const double dx = x - p[at_x];
  const double dy = y - p[at_y];
  const double cos_u = std::cos(p[angle_u]), sin_u = std::sin(p[angle_u]);
  const double cos_v = std::cos(p[angle_v]), sin_v = std::sin(p[angle_v]);
  // Signed distances from the edge along u and from the edge along v.
  const double from_u = cos_u * dy - sin_u * dx;
  const double from_v = cos_v * dy - sin_v * dx;
  const double inverse_blur = std::exp(-p[log_blur]) * std::numbers::sqrt2 * 0.5;
  const double s = from_u * inverse_blur;
  const double t = from_v * inverse_blur;
  const double edge_u = std::erf(s);
  const double edge_v = std::erf(t);
  constexpr double two_over_root_pi = 2.0 * std::numbers::inv_sqrtpi;
  const double d_edge_u = two_over_root_pi * std::exp(-s * s);
  const double d_edge_v = two_over_root_pi * std::exp(-t * t);
  // Black where squares are black, and where a marker's corner begins in a white one.
  double pattern = edge_u * edge_v;
  double pattern_by_u = edge_v * d_edge_u;
  double pattern_by_v = edge_u * d_edge_v;
  double pattern_by_marker = 0.0;  // times log_blur's inner derivative, the shift's part
  for (const double side : {-1.0, 1.0}) {
    // In white squares the signed distances have the product's sign: both, or one turned.
    const double a = (side * from_u - around.marker_u_px) * inverse_blur;
    const double b = (side * around.sign * from_v - around.marker_v_px) * inverse_blur;
    if (a < -4.0 || b < -4.0) continue;
    const double in_u = 0.5 * (1.0 + std::erf(a));
    const double in_v = 0.5 * (1.0 + std::erf(b));
    const double d_in_u = 0.5 * two_over_root_pi * std::exp(-a * a);
    const double d_in_v = 0.5 * two_over_root_pi * std::exp(-b * b);
    const double depth = 2.0 * around.sign;
    pattern -= depth * in_u * in_v;
    pattern_by_u -= depth * in_v * d_in_u * side;
    pattern_by_v -= depth * in_u * d_in_v * side * around.sign;
    pattern_by_marker += depth * inverse_blur *
                         (in_v * d_in_u * around.marker_u_px + in_u * d_in_v * around.marker_v_px);
  }
  const double paper = p[middle] + p[contrast] * pattern;
  const double light = 1.0 + p[slope_x] * dx + p[slope_y] * dy;
  const double by_u = light * p[contrast] * pattern_by_u * inverse_blur;
  const double by_v = light * p[contrast] * pattern_by_v * inverse_blur;
  slope[at_x] = by_u * sin_u + by_v * sin_v - paper * p[slope_x];
  slope[at_y] = -by_u * cos_u - by_v * cos_v - paper * p[slope_y];
  slope[angle_u] = -by_u * (sin_u * dy + cos_u * dx);
  slope[angle_v] = -by_v * (sin_v * dy + cos_v * dx);
  // d a / d log_blur = -a: the part of from_u and from_v, and that of the markers' distance, which
  // enters a with the opposite sign.
  slope[log_blur] = -by_u * from_u - by_v * from_v - light * p[contrast] * pattern_by_marker;
  slope[middle] = light;
  slope[contrast] = light * pattern;
  slope[slope_x] = paper * dx;
  slope[slope_y] = paper * dy;
  return paper * light;
}

double squared_error(const Surroundings& around, const std::vector<Pixel>& pixels,
                     const Unknowns& p) {
  Unknowns unused;
  double sum = 0.0;
  for (const Pixel& pixel : pixels) {
    const double error = model(around, p, pixel.x, pixel.y, unused) - pixel.level;
    sum += error * error;
  }
  return sum;
}

/// Levenberg-Marquardt (Marquardt 1963); returns the squared error reached.
double minimise(const Surroundings& around, const std::vector<Pixel>& pixels, Unknowns& p) {
  double error = squared_error(around, pixels, p);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 40; ++iteration) {
    Normal normal = Normal::Zero();
    Unknowns gradient = Unknowns::Zero();
    Unknowns slope;
    for (const Pixel& pixel : pixels) {
      const double residual = model(around, p, pixel.x, pixel.y, slope) - pixel.level;
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
        step_px = std::hypot(step[at_x], step[at_y]);
        p = next;
        error = next_error;
        damping = std::max(1e-9, damping * 0.1);
        improved = true;
      } else {
        damping *= 10.0;
      }
    }
    if (!improved || step_px < 1e-4) break;
  }
  return error;
}

double angle_between(double a, double b) {
  return std::abs(std::remainder(a - b, 2.0 * std::numbers::pi));
}

}  // namespace

std::optional<Eigen::Vector2d> fit_corner(const Image8& grey, const ExpectedCorner& expected) {
  // Fewer pixels than this (a corner at the image's rim) don't determine nine unknowns well.
  constexpr std::size_t min_pixels = 30;
  constexpr double min_contrast = 5.0;   // grey levels, half the step from black to white
  constexpr double min_explained = 0.8;  // of the pixels' variance
  constexpr double max_turn = 0.35;      // radians, against the expected edges

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
    const double error = minimise(around, pixels, p);
    const double shift = (p.head<2>() - expected.position_px).norm();
    // Negated comparisons also catch what is not a number.
    if (!(shift <= expected.max_shift_px)) return std::nullopt;
    if (!(sign * p[contrast] >= min_contrast)) return std::nullopt;
    if (!(error <= (1.0 - min_explained) * variance)) return std::nullopt;
    if (angle_between(p[angle_u], expected_u) > max_turn) return std::nullopt;
    if (angle_between(p[angle_v], expected_v) > max_turn) return std::nullopt;
    const double square_px = expected.square_mm * std::sqrt(std::abs(a.determinant()));
    if (!(std::exp(p[log_blur]) < 0.25 * square_px)) return std::nullopt;
  }
  return Eigen::Vector2d(p[at_x], p[at_y]);
}

}  // namespace skullstation
