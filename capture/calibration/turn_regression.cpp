#include "capture/calibration/turn_regression.h"

#include <algorithm>
#include <cmath>

#include "core/median.h"
#include "core/units.h"

namespace skullstation {

namespace {

struct Line {
  double slope = 1.0;
  double offset = 0.0;
  double slope_error = 0.0;
};

Line weighted_line(const std::vector<double>& x, const std::vector<double>& y,
                   const std::vector<double>& weights) {
  double sum = 0.0, mean_x = 0.0, mean_y = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    sum += weights[i];
    mean_x += weights[i] * x[i];
    mean_y += weights[i] * y[i];
  }
  mean_x /= sum;
  mean_y /= sum;
  double xx = 0.0, xy = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += weights[i] * (x[i] - mean_x) * (x[i] - mean_x);
    xy += weights[i] * (x[i] - mean_x) * (y[i] - mean_y);
  }
  Line line;
  line.slope = xx > 0.0 ? xy / xx : 1.0;
  line.offset = mean_y - line.slope * mean_x;
  double error = 0.0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    const double residual = y[i] - line.offset - line.slope * x[i];
    error += weights[i] * residual * residual;
  }
  const double freedom = static_cast<double>(x.size()) - 2.0;
  line.slope_error = xx > 0.0 ? std::sqrt(error / freedom / xx) : 0.0;
  return line;
}

Line robust_line(const std::vector<double>& x, const std::vector<double>& y) {
  constexpr double tuning = 1.345;  // 95 % efficient where errors are normal
  std::vector<double> weights(x.size(), 1.0);
  Line line = weighted_line(x, y, weights);
  for (int iteration = 0; iteration < 30; ++iteration) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < x.size(); ++i) {
      distances.push_back(std::abs(y[i] - line.offset - line.slope * x[i]));
    }
    // Never zero, so that angles without any error keep their weights.
    const double scale = std::max(1.4826 * median(distances), 1e-9);
    for (std::size_t i = 0; i < x.size(); ++i) {
      weights[i] = distances[i] <= tuning * scale ? 1.0 : tuning * scale / distances[i];
    }
    line = weighted_line(x, y, weights);
  }
  return line;
}

/// `angles` with full turns added so that every step from stop to stop is nearest to `steps`.
std::vector<double> continued(const std::vector<double>& angles, const std::vector<double>& steps) {
  std::vector<double> result = {angles.front()};
  for (std::size_t i = 1; i < angles.size(); ++i) {
    const double expected = result.back() + steps[i];
    result.push_back(expected + turn_deg(expected, angles[i]));
  }
  return result;
}

}  // namespace

TurnRegression regress_turns(const std::vector<double>& commanded_deg,
                             const std::vector<double>& measured_deg) {
  const std::size_t count = commanded_deg.size();
  std::vector<double> steps(count, 0.0);
  TurnRegression result;
  result.commanded_deg = {commanded_deg.front()};
  for (std::size_t i = 1; i < count; ++i) {
    steps[i] = turn_deg(commanded_deg[i - 1], commanded_deg[i]);
    result.commanded_deg.push_back(result.commanded_deg.back() + steps[i]);
  }
  std::vector<double> best_measured;
  Line best;
  double best_departure = 0.0;
  for (const double direction : {1.0, -1.0}) {
    std::vector<double> expected = steps;
    for (double& step : expected) step *= direction;
    const std::vector<double> measured = continued(measured_deg, expected);
    double departure = 0.0;
    for (std::size_t i = 1; i < count; ++i) {
      departure += std::abs(measured[i] - measured[i - 1] - expected[i]);
    }
    if (best_measured.empty() || departure < best_departure) {
      best_departure = departure;
      best_measured = measured;
    }
  }
  best = robust_line(result.commanded_deg, best_measured);
  result.slope = best.slope;
  result.slope_error = best.slope_error;
  result.offset_deg = best.offset;
  double squares = 0.0;
  for (std::size_t i = 0; i < count; ++i) {
    result.measured_deg.push_back(best_measured[i] - best.offset);
    result.residual_deg.push_back(result.measured_deg[i] - best.slope * result.commanded_deg[i]);
    squares += result.residual_deg[i] * result.residual_deg[i];
  }
  result.rms_deg = std::sqrt(squares / static_cast<double>(count));
  return result;
}

}  // namespace skullstation
