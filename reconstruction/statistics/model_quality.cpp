#include "reconstruction/statistics/model_quality.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "core/parallel.h"
#include "core/random.h"

namespace skullstation {

namespace {

using Eigen::Index;

/// Weighted mean distance between corresponding vertices.
double mean_distance(const Points3& a, const Points3& b, const Eigen::VectorXd& weights) {
  return (a - b).rowwise().norm().dot(weights) / weights.sum();
}

/// Only the vertices with weight: the others would cost time without a say.
std::vector<Points3> weighted_part(std::span<const Points3> shapes,
                                   const Eigen::VectorXd& weights) {
  std::vector<Index> used;
  for (Index v = 0; v < weights.size(); ++v) {
    if (weights[v] > 0.0) used.push_back(v);
  }
  std::vector<Points3> parts;
  for (const Points3& shape : shapes) parts.push_back(shape(used, Eigen::all));
  return parts;
}

}  // namespace

Result<void> ModelQualityOptions::validate() const {
  const auto bad = [](const char* option) {
    return fail(ErrorKind::bad_input, std::string("model quality, ") + option,
                "must be at least 1");
  };
  if (max_modes < 1) return bad("max_modes");
  if (random_members < 1) return bad("random_members");
  return {};
}

Result<ModelQuality> model_quality(std::span<const Points3> shapes,
                                   const Eigen::VectorXd& vertex_weights,
                                   const ModelQualityOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (shapes.size() < 4) {
    return fail(ErrorKind::bad_input, "model quality", "needs at least 4 shapes", "add subjects");
  }
  const ShapeModelOptions all_modes{1.0, options.max_modes};
  if (const auto sound = build_shape_model(shapes, vertex_weights, all_modes); !sound) {
    return forward(sound);
  }
  const std::vector<Points3> parts = weighted_part(shapes, vertex_weights);
  Eigen::VectorXd weights(parts.front().rows());
  for (Index v = 0, i = 0; v < vertex_weights.size(); ++v) {
    if (vertex_weights[v] > 0.0) weights[i++] = vertex_weights[v];
  }
  const auto full = build_shape_model(parts, weights, {1.0, 1000});
  if (!full) return forward(full);
  const auto modes = static_cast<std::size_t>(std::min<Index>(
      {options.max_modes, full->mode_count(), static_cast<Index>(shapes.size()) - 2}));

  ModelQuality quality;
  double cumulated = 0.0;
  for (std::size_t m = 0; m < modes; ++m) {
    cumulated += full->variances[static_cast<Index>(m)];
    quality.compactness.push_back(cumulated / full->variances.sum());
  }

  std::vector<std::vector<double>> errors(parts.size());
  parallel_for(static_cast<int>(parts.size()), options.threads, [&](int left_out) {
    std::vector<Points3> others = parts;
    others.erase(others.begin() + left_out);
    const ShapeModel model = build_shape_model(others, weights, all_modes).value();
    const Points3& shape = parts[static_cast<std::size_t>(left_out)];
    const Eigen::VectorXd coefficients = coefficients_of(model, shape);
    for (std::size_t m = 1; m <= modes; ++m) {
      const Index used = std::min(static_cast<Index>(m), coefficients.size());
      errors[static_cast<std::size_t>(left_out)].push_back(
          mean_distance(shape, shape_at(model, coefficients.head(used)), weights));
    }
  });
  const auto count = static_cast<double>(parts.size());
  for (std::size_t m = 0; m < modes; ++m) {
    double sum = 0.0;
    double squares = 0.0;
    for (const std::vector<double>& of_shape : errors) {
      sum += of_shape[m];
      squares += of_shape[m] * of_shape[m];
    }
    const double variance = std::max(0.0, (squares - sum * sum / count) / (count - 1.0));
    quality.generalisation_mm.push_back(sum / count);
    quality.generalisation_error_mm.push_back(std::sqrt(variance / count));
  }

  for (std::size_t m = 1; m <= modes; ++m) {
    std::vector<double> nearest(static_cast<std::size_t>(options.random_members));
    parallel_for(options.random_members, options.threads, [&](int member) {
      Random random(mix(mix(options.seed, m), static_cast<std::uint64_t>(member)));
      Eigen::VectorXd coefficients(static_cast<Index>(m));
      for (double& b : coefficients) b = random.normal();
      const Points3 shape = shape_at(*full, coefficients);
      double least = std::numeric_limits<double>::infinity();
      for (const Points3& known : parts) {
        least = std::min(least, mean_distance(shape, known, weights));
      }
      nearest[static_cast<std::size_t>(member)] = least;
    });
    quality.specificity_mm.push_back(std::accumulate(nearest.begin(), nearest.end(), 0.0) /
                                     static_cast<double>(nearest.size()));
  }
  return quality;
}

}  // namespace skullstation
