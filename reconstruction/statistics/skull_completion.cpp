#include "reconstruction/statistics/skull_completion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruction/registration/point_tree.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// What the modes leave over in people whom the model has not seen, over which length it stays
/// alike, and what a fit adds at each vertex. Chosen by hiding parts of 39 fitted whole skulls of
/// the default model's people, each foretold by the others (docs/models.md).
constexpr double rest_sd_mm = 2.0;
constexpr double rest_length_mm = 40.0;
constexpr double fit_sd_mm = 0.5;
/// Observed vertices that the completion starts from, spread over the bone.
constexpr std::size_t node_count = 600;
/// How far from the observed bone a completion still follows what is finer than its nodes.
constexpr double transition_mm = 15.0;

/// Near a break a fit takes one thing for another: what lies closer to it is not believed.
constexpr double doubtful_mm = 8.0;

/// The observed outer vertices that are believed.
std::vector<int> believed(const SkullTemplate& skull, const std::vector<bool>& observed) {
  std::vector<int> seen = observed_outer(skull, observed);
  std::vector<int> missing;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (skull.outer[at] && !observed[at]) missing.push_back(v);
  }
  if (missing.empty()) return seen;
  const PointTree breaks(skull.vertices(missing, Eigen::all));
  std::vector<int> sound = seen;
  std::erase_if(sound, [&](int v) {
    return breaks.nearest(skull.vertices.row(v).transpose()).squared_distance <
           doubtful_mm * doubtful_mm;
  });
  // A skull of nothing but breaks has to be believed.
  return sound.empty() ? seen : sound;
}

/// Covariance of the rest between points of the template, #a x #b.
MatrixXd rest_covariance(const Points3& a, const Points3& b) {
  MatrixXd covariance(a.rows(), b.rows());
  for (Index j = 0; j < b.rows(); ++j) {
    covariance.col(j) = (a.rowwise() - b.row(j)).rowwise().squaredNorm();
  }
  return (rest_sd_mm * rest_sd_mm) *
         (covariance.array() / (-2.0 * rest_length_mm * rest_length_mm)).exp();
}

/// Rows of the modes that belong to one axis of these vertices, #vertices x #modes.
MatrixXd modes_along(const MatrixXd& modes, const std::vector<int>& vertices, int axis) {
  MatrixXd rows(static_cast<Index>(vertices.size()), modes.cols());
  for (Index i = 0; i < rows.rows(); ++i) {
    rows.row(i) = modes.row(3 * Index{vertices[static_cast<std::size_t>(i)]} + axis);
  }
  return rows;
}

class Kriging {
 public:
  Kriging(const SkullTemplate& skull, const ShapeModel& model, const Points3& vertices,
          const std::vector<int>& seen)
      : skull_(skull), modes_(model.scaled_modes()), mean_(unflattened(model.mean)) {
    const std::size_t step = std::max<std::size_t>(1, seen.size() / node_count);
    for (std::size_t i = 0; i < seen.size(); i += step) nodes_.push_back(seen[i]);
    places_ = skull.vertices(nodes_, Eigen::all);
    MatrixXd covariance = rest_covariance(places_, places_);
    covariance.diagonal().array() += fit_sd_mm * fit_sd_mm;
    covariance_.compute(covariance);

    const Points3 offsets = vertices(nodes_, Eigen::all) - mean_(nodes_, Eigen::all);
    MatrixXd information = MatrixXd::Identity(modes_.cols(), modes_.cols());
    VectorXd right = VectorXd::Zero(modes_.cols());
    for (int axis = 0; axis < 3; ++axis) {
      const MatrixXd trend = modes_along(modes_, nodes_, axis);
      const MatrixXd solved = covariance_.solve(trend);
      information += trend.transpose() * solved;
      right += solved.transpose() * offsets.col(axis);
    }
    information_.compute(information);
    coefficients_ = information_.solve(right);
    Points3 rest(offsets.rows(), 3);
    for (int axis = 0; axis < 3; ++axis) {
      rest.col(axis) = offsets.col(axis) - modes_along(modes_, nodes_, axis) * coefficients_;
    }
    weights_ = covariance_.solve(MatrixXd(rest));
  }

  /// #wanted x 3
  Points3 likely(const std::vector<int>& wanted) const {
    const Points3 at = skull_.vertices(wanted, Eigen::all);
    Points3 result = mean_(wanted, Eigen::all);
    result += rest_covariance(at, places_) * weights_;
    for (int axis = 0; axis < 3; ++axis) {
      result.col(axis) += modes_along(modes_, wanted, axis) * coefficients_;
    }
    return result;
  }

  VectorXd sd_mm(const std::vector<int>& wanted) const {
    const MatrixXd between = rest_covariance(skull_.vertices(wanted, Eigen::all), places_);
    const MatrixXd weights = covariance_.solve(between.transpose()).transpose();
    const VectorXd known = weights.cwiseProduct(between).rowwise().sum();
    VectorXd variance = (rest_sd_mm * rest_sd_mm - known.array()).max(0.0);
    for (int axis = 0; axis < 3; ++axis) {
      const MatrixXd untold =
          modes_along(modes_, wanted, axis) - weights * modes_along(modes_, nodes_, axis);
      variance +=
          information_.matrixL().solve(untold.transpose()).colwise().squaredNorm().transpose() /
          3.0;
    }
    return variance.cwiseSqrt();
  }

 private:
  const SkullTemplate& skull_;
  const MatrixXd modes_;
  const Points3 mean_;
  std::vector<int> nodes_;
  Points3 places_;
  Eigen::LLT<MatrixXd> covariance_;   // of the nodes' rest
  Eigen::LLT<MatrixXd> information_;  // about the modes
  VectorXd coefficients_;
  MatrixXd weights_;  // #nodes x 3
};

}  // namespace

CompletedSkull completed_skull(const SkullTemplate& skull, const ShapeModel& model,
                               const Points3& vertices, const std::vector<bool>& observed) {
  const std::vector<int> seen = believed(skull, observed);
  CompletedSkull completed{vertices, VectorXd::Zero(skull.boundary_count)};
  if (seen.empty()) {
    completed.vertices = unflattened(model.mean);
    completed.sd_mm =
        (vertex_sd_mm(model, population_belief(model)).head(skull.boundary_count).array().square() +
         rest_sd_mm * rest_sd_mm)
            .sqrt();
    return completed;
  }
  std::vector<int> missing;
  for (Index v = 0; v < vertices.rows(); ++v) {
    if (v < skull.boundary_count && observed[static_cast<std::size_t>(v)]) continue;
    missing.push_back(static_cast<int>(v));
  }
  const Kriging kriging(skull, model, vertices, seen);
  const Points3 likely = kriging.likely(missing);
  const Points3 finer = vertices(seen, Eigen::all) - kriging.likely(seen);
  const PointTree tree(skull.vertices(seen, Eigen::all));
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const int v = missing[i];
    Eigen::RowVector3d offset = Eigen::RowVector3d::Zero();
    double weight_sum = 0.0;
    double nearest_squared = std::numeric_limits<double>::infinity();
    for (const NearPoint& near : tree.nearest(skull.vertices.row(v).transpose(), 12)) {
      const double weight = 1.0 / (near.squared_distance + 1.0);
      offset += weight * finer.row(near.index);
      weight_sum += weight;
      nearest_squared = std::min(nearest_squared, near.squared_distance);
    }
    completed.vertices.row(v) =
        likely.row(static_cast<Index>(i)) +
        std::exp(-std::sqrt(nearest_squared) / transition_mm) * offset / weight_sum;
  }
  std::erase_if(missing, [&](int v) { return v >= skull.boundary_count; });
  const VectorXd sd_mm = kriging.sd_mm(missing);
  for (std::size_t i = 0; i < missing.size(); ++i) {
    completed.sd_mm[missing[i]] = sd_mm[static_cast<Index>(i)];
  }
  return completed;
}

}  // namespace skullstation
