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

/// Pixels of the cross around `center`: within `half_width` of one edge and `half_length` along
/// it, both in px, limited by what is free of markers and by the square itself.
std::vector<Pixel> cross_pixels(const Image8& grey, const ExpectedCorner& expected,
                                const Eigen::Vector2d& center) {
  const Eigen::Matrix2d& a = expected.px_from_mm;
  const Eigen::Vector2d scale(a.col(0).norm(), a.col(1).norm());  // px per mm along u, v
  // Distance in px between lines 1 mm apart.
  const double area = std::abs(a.determinant());
  const Eigen::Vector2d spacing(area / scale.y(), area / scale.x());
  Eigen::Vector2d half_width;   // mm, across the edges u = 0 and v = 0
  Eigen::Vector2d half_length;  // mm, along the axes u and v
  for (int axis = 0; axis < 2; ++axis) {
    const double free_px = expected.free_mm * spacing[axis];
    half_width[axis] = std::clamp(free_px - 1.0, 2.0, 6.0) / spacing[axis];
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

/// The model's level at a pixel and its derivatives.
double model(const Unknowns& p, double x, double y, Unknowns& slope) {
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
  const double paper = p[middle] + p[contrast] * edge_u * edge_v;
  const double light = 1.0 + p[slope_x] * dx + p[slope_y] * dy;
  const double by_u = light * p[contrast] * edge_v * d_edge_u * inverse_blur;
  const double by_v = light * p[contrast] * edge_u * d_edge_v * inverse_blur;
  slope[at_x] = by_u * sin_u + by_v * sin_v - paper * p[slope_x];
  slope[at_y] = -by_u * cos_u - by_v * cos_v - paper * p[slope_y];
  slope[angle_u] = -by_u * (sin_u * dy + cos_u * dx);
  slope[angle_v] = -by_v * (sin_v * dy + cos_v * dx);
  slope[log_blur] = -by_u * from_u - by_v * from_v;
  slope[middle] = light;
  slope[contrast] = light * edge_u * edge_v;
  slope[slope_x] = paper * dx;
  slope[slope_y] = paper * dy;
  return paper * light;
}

double squared_error(const std::vector<Pixel>& pixels, const Unknowns& p) {
  Unknowns unused;
  double sum = 0.0;
  for (const Pixel& pixel : pixels) {
    const double error = model(p, pixel.x, pixel.y, unused) - pixel.level;
    sum += error * error;
  }
  return sum;
}

/// Levenberg-Marquardt (Marquardt 1963); returns the squared error reached.
double minimise(const std::vector<Pixel>& pixels, Unknowns& p) {
  double error = squared_error(pixels, p);
  double damping = 1e-3;
  for (int iteration = 0; iteration < 40; ++iteration) {
    Normal normal = Normal::Zero();
    Unknowns gradient = Unknowns::Zero();
    Unknowns slope;
    for (const Pixel& pixel : pixels) {
      const double residual = model(p, pixel.x, pixel.y, slope) - pixel.level;
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
      const double next_error = squared_error(pixels, next);
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
    const double error = minimise(pixels, p);
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
