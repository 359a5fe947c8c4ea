#include "reconstruction/statistics/skull_completion.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "reconstruction/registration/observed_bone.h"
#include "reconstruction/registration/point_tree.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// The first four were chosen by hiding parts of whole skulls of the default model's people, each
// foretold by the others (docs/models.md).

/// Correlations of the model fall to `far_correlation` of what they are over some such length.
constexpr double local_length_mm = 80.0;
constexpr double far_correlation = 0.3;
/// What the modes leave over in people whom the model has not seen, and over which length it stays
/// alike.
constexpr double rest_sd_mm = 2.0;
constexpr double rest_length_mm = 40.0;
/// How far a fitted vertex may lie from its place, across the surface and along it. Near a break
/// nothing holds a fit along the surface, and it may take one thing for another: what lies closer
/// than `doubtful_mm` is not believed at all.
constexpr double across_sd_mm = 0.5;
constexpr double along_sd_mm = 1.0;
constexpr double along_break_sd_mm = 12.0;
constexpr double break_reach_mm = 15.0;
constexpr double doubtful_mm = 8.0;
/// Observed vertices that the completion starts from, spread over the bone, and missing ones whose
/// uncertainty is computed.
constexpr std::size_t node_count = 300;
constexpr std::size_t probe_count = 500;
/// How far from the observed bone a completion still follows what is finer than its nodes.
constexpr double transition_mm = 15.0;

/// About `count` of them, evenly.
std::vector<int> thinned(const std::vector<int>& vertices, std::size_t count) {
  std::vector<int> some;
  const std::size_t step = std::max<std::size_t>(1, vertices.size() / count);
  for (std::size_t i = 0; i < vertices.size(); i += step) some.push_back(vertices[i]);
  return some;
}

/// Distance of these vertices from where bone is missing, on the template; infinite where nothing
/// is. A foramen that a fit does not find is no break: most of the bone around it is there.
VectorXd distance_to_break_mm(const SkullTemplate& skull, const std::vector<bool>& observed,
                              const std::vector<int>& vertices) {
  const VectorXd around = observed_around(skull, observed);
  std::vector<int> broken;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (skull.outer[at] && !observed[at] && around[v] <= 0.5) broken.push_back(v);
  }
  VectorXd distance_mm = VectorXd::Constant(static_cast<Index>(vertices.size()),
                                            std::numeric_limits<double>::infinity());
  if (broken.empty()) return distance_mm;
  const PointTree breaks(skull.vertices(broken, Eigen::all));
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    distance_mm[static_cast<Index>(i)] =
        std::sqrt(breaks.nearest(skull.vertices.row(vertices[i]).transpose()).squared_distance);
  }
  return distance_mm;
}

/// The observed outer vertices that are believed.
std::vector<int> believed(const SkullTemplate& skull, const std::vector<bool>& observed) {
  const std::vector<int> seen = observed_outer(skull, observed);
  const VectorXd distance_mm = distance_to_break_mm(skull, observed, seen);
  std::vector<int> sound;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    if (distance_mm[static_cast<Index>(i)] >= doubtful_mm) sound.push_back(seen[i]);
  }
  // A skull of nothing but breaks has to be believed.
  return sound.empty() ? seen : sound;
}

/// Skulls as a Gaussian process over the template's vertices. Coordinates of vertices come as
/// x0 y0 z0 x1 ...
class SkullProcess {
 public:
  SkullProcess(const SkullTemplate& skull, const ShapeModel& model)
      : skull_(skull), modes_(model.scaled_modes()) {}

  /// 3 #a x 3 #b [mm^2]
  MatrixXd covariance(const std::vector<int>& a, const std::vector<int>& b) const {
    MatrixXd result = modes_of(a) * modes_of(b).transpose();
    for (std::size_t i = 0; i < a.size(); ++i) {
      for (std::size_t j = 0; j < b.size(); ++j) {
        const double squared =
            (skull_.vertices.row(a[i]) - skull_.vertices.row(b[j])).squaredNorm();
        const double near = std::exp(squared / (-2.0 * local_length_mm * local_length_mm));
        auto block = result.block<3, 3>(3 * static_cast<Index>(i), 3 * static_cast<Index>(j));
        block *= far_correlation + (1.0 - far_correlation) * near;
        block.diagonal().array() +=
            rest_sd_mm * rest_sd_mm * std::exp(squared / (-2.0 * rest_length_mm * rest_length_mm));
      }
    }
    return result;
  }

  /// 3 #vertices x #modes [mm]
  MatrixXd modes_of(const std::vector<int>& vertices) const {
    MatrixXd rows(3 * static_cast<Index>(vertices.size()), modes_.cols());
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      rows.middleRows<3>(3 * static_cast<Index>(i)) = modes_.middleRows<3>(3 * Index{vertices[i]});
    }
    return rows;
  }

 private:
  const SkullTemplate& skull_;
  const MatrixXd modes_;
};

/// How fitted vertices err, a block for each.
std::vector<Eigen::Matrix3d> fit_errors(const SkullTemplate& skull, const Points3& vertices,
                                        const std::vector<bool>& observed,
                                        const std::vector<int>& nodes) {
  const Points3 normals = surface_of(skull, vertices).normals;
  const VectorXd to_break_mm = distance_to_break_mm(skull, observed, nodes);
  std::vector<Eigen::Matrix3d> errors;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const Eigen::Vector3d normal = normals.row(nodes[i]);
    const Eigen::Matrix3d across = normal * normal.transpose();
    const double along_mm =
        along_sd_mm +
        along_break_sd_mm * std::exp(-to_break_mm[static_cast<Index>(i)] / break_reach_mm);
    errors.emplace_back(across_sd_mm * across_sd_mm * across +
                        along_mm * along_mm * (Eigen::Matrix3d::Identity() - across));
  }
  return errors;
}

/// The process where some vertices are known.
class KnownSkull {
 public:
  KnownSkull(const SkullProcess& process, const Points3& mean, const Points3& vertices,
             std::vector<int> nodes, const std::vector<Eigen::Matrix3d>& errors)
      : process_(process), mean_(mean), nodes_(std::move(nodes)) {
    MatrixXd covariance = process.covariance(nodes_, nodes_);
    for (std::size_t i = 0; i < errors.size(); ++i) {
      const auto at = 3 * static_cast<Index>(i);
      covariance.block<3, 3>(at, at) += errors[i];
    }
    factor_.compute(covariance);
    weights_ = factor_.solve(flattened(vertices(nodes_, Eigen::all) - mean(nodes_, Eigen::all)));
  }

  /// #wanted x 3
  Points3 likely(const std::vector<int>& wanted) const {
    // In blocks, since there may be tens of thousands.
    constexpr std::size_t block = 500;
    Points3 result(static_cast<Index>(wanted.size()), 3);
    for (std::size_t begin = 0; begin < wanted.size(); begin += block) {
      const std::vector<int> some(
          wanted.begin() + static_cast<std::ptrdiff_t>(begin),
          wanted.begin() + static_cast<std::ptrdiff_t>(std::min(begin + block, wanted.size())));
      result.middleRows(static_cast<Index>(begin), static_cast<Index>(some.size())) =
          mean_(some, Eigen::all) + unflattened(process_.covariance(some, nodes_) * weights_);
    }
    return result;
  }

  /// What remains unknown of the wanted vertices' coordinates, 3 #wanted x 3 #wanted [mm^2].
  MatrixXd covariance(const std::vector<int>& wanted) const {
    const MatrixXd told = factor_.matrixL().solve(process_.covariance(nodes_, wanted));
    return process_.covariance(wanted, wanted) - told.transpose() * told;
  }

 private:
  const SkullProcess& process_;
  const Points3& mean_;
  std::vector<int> nodes_;
  Eigen::LLT<MatrixXd> factor_;
  VectorXd weights_;
};

/// Root mean variance of each probe's coordinates.
VectorXd sd_of(const MatrixXd& covariance) {
  VectorXd sd(covariance.rows() / 3);
  for (Index i = 0; i < sd.size(); ++i) {
    sd[i] = std::sqrt(std::max(0.0, covariance.diagonal().segment<3>(3 * i).mean()));
  }
  return sd;
}

}  // namespace

CompletedSkull completed_skull(const SkullTemplate& skull, const ShapeModel& model,
                               const Points3& vertices, const std::vector<bool>& observed) {
  const std::vector<int> seen = believed(skull, observed);
  const Index modes = model.mode_count();
  CompletedSkull completed{vertices, VectorXd::Zero(skull.boundary_count),
                           MatrixXd::Zero(modes, modes)};
  const Points3 mean = unflattened(model.mean);
  if (seen.empty()) {
    completed.vertices = mean;
    completed.sd_mm =
        (vertex_sd_mm(model, population_belief(model)).head(skull.boundary_count).array().square() +
         rest_sd_mm * rest_sd_mm)
            .sqrt();
    completed.coefficient_covariance.setIdentity();
    return completed;
  }
  std::vector<int> missing;  // those on the surface first
  for (Index v = 0; v < vertices.rows(); ++v) {
    if (v < skull.boundary_count && observed[static_cast<std::size_t>(v)]) continue;
    missing.push_back(static_cast<int>(v));
  }
  if (missing.empty()) return completed;

  const SkullProcess process(skull, model);
  const std::vector<int> nodes = thinned(seen, node_count);
  const KnownSkull known(process, mean, vertices, nodes,
                         fit_errors(skull, vertices, observed, nodes));
  const Points3 likely = known.likely(missing);
  const Points3 finer = vertices(seen, Eigen::all) - known.likely(seen);
  const PointTree near_seen(skull.vertices(seen, Eigen::all));
  for (std::size_t i = 0; i < missing.size(); ++i) {
    const int v = missing[i];
    Eigen::RowVector3d offset = Eigen::RowVector3d::Zero();
    double weight_sum = 0.0;
    double nearest_squared = std::numeric_limits<double>::infinity();
    for (const NearPoint& near : near_seen.nearest(skull.vertices.row(v).transpose(), 12)) {
      const double weight = 1.0 / (near.squared_distance + 1.0);
      offset += weight * finer.row(near.index);
      weight_sum += weight;
      nearest_squared = std::min(nearest_squared, near.squared_distance);
    }
    completed.vertices.row(v) =
        likely.row(static_cast<Index>(i)) +
        std::exp(-std::sqrt(nearest_squared) / transition_mm) * offset / weight_sum;
  }

  const std::vector<int> probes = thinned(missing, probe_count);
  const MatrixXd unknown = known.covariance(probes);
  const VectorXd sd_mm = sd_of(unknown);
  const PointTree near_probes(skull.vertices(probes, Eigen::all));
  for (const int v : missing) {
    if (v >= skull.boundary_count) break;
    completed.sd_mm[v] = sd_mm[near_probes.nearest(skull.vertices.row(v).transpose()).index];
  }
  // Each probe stands for the missing vertices around it.
  const double each = static_cast<double>(missing.size()) / static_cast<double>(probes.size());
  const MatrixXd coefficients_of_probes =
      each * (process.modes_of(probes) * model.variances.cwiseInverse().asDiagonal());
  completed.coefficient_covariance =
      coefficients_of_probes.transpose() * unknown * coefficients_of_probes;
  return completed;
}

}  // namespace skullstation
