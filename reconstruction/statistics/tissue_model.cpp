#include "reconstruction/statistics/tissue_model.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <memory>
#include <span>

#include "core/linear_algebra.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr double not_a_number = std::numeric_limits<double>::quiet_NaN();
/// Two per cent: no measured depth is better than that.
constexpr double least_noise_sd = 0.02;
/// Residuals beyond so many scales of Student's t are no part of the noise.
constexpr double outlier_scales = 5.0;
/// Keeps the regression sound where subjects are few.
constexpr double least_information = 0.1;

tl::unexpected<Error> bad(std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, "tissue model", std::move(what), std::move(advice));
}

/// Draws values at the vertices of a surface towards those around, the more the fewer subjects a
/// vertex was measured in: the minimum of
/// sum count (m - value)^2 + strength sum over edges (m_a - m_b)^2.
class Smoothing {
 public:
  Smoothing(const Eigen::VectorXi& count, const Triangles& triangles, double strength)
      : count_(count.cast<double>().array() + 1e-9),
        factor_(std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>()) {
    using Triplet = Eigen::Triplet<double>;
    std::vector<Triplet> entries;
    entries.reserve(static_cast<std::size_t>(12 * triangles.rows() + count.size()));
    for (Index t = 0; t < triangles.rows(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int a = triangles(t, k);
        const int b = triangles(t, (k + 1) % 3);
        // Each inner edge comes twice.
        entries.emplace_back(a, a, 0.5 * strength);
        entries.emplace_back(b, b, 0.5 * strength);
        entries.emplace_back(a, b, -0.5 * strength);
        entries.emplace_back(b, a, -0.5 * strength);
      }
    }
    for (Index v = 0; v < count.size(); ++v) entries.emplace_back(v, v, count_[v]);
    Eigen::SparseMatrix<double> system(count.size(), count.size());
    system.setFromTriplets(entries.begin(), entries.end());
    factor_->compute(system);
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& values) const {
    return factor_->solve(count_.cwiseProduct(values));
  }

 private:
  Eigen::VectorXd count_;
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> factor_;
};

/// The triangles whose corners are all used, with the numbers that `used` gives them.
Triangles renumbered(const Triangles& triangles, std::span<const Index> used, Index vertices) {
  std::vector<int> number(static_cast<std::size_t>(vertices), -1);
  for (std::size_t i = 0; i < used.size(); ++i) {
    number[static_cast<std::size_t>(used[i])] = static_cast<int>(i);
  }
  Triangles result(triangles.rows(), 3);
  Index kept = 0;
  for (Index t = 0; t < triangles.rows(); ++t) {
    Eigen::RowVector3i corners;
    for (int k = 0; k < 3; ++k) corners[k] = number[static_cast<std::size_t>(triangles(t, k))];
    if (corners.minCoeff() >= 0) result.row(kept++) = corners;
  }
  return result.topRows(kept);
}

struct Spread {
  double median = 0.0;
  double sd = 0.0;  ///< from the median absolute deviation
};

/// Of the entries that are numbers.
Spread spread_of(const Eigen::RowVectorXd& values) {
  const auto median = [](std::vector<double>& of) {
    const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
    std::nth_element(of.begin(), middle, of.end());
    return *middle;
  };
  std::vector<double> seen;
  std::ranges::copy_if(values, std::back_inserter(seen), [](double x) { return !std::isnan(x); });
  Spread spread{median(seen), 0.0};
  for (double& value : seen) value = std::abs(value - spread.median);
  spread.sd = 1.4826 * median(seen);
  return spread;
}

/// The expectation maximisation's state; only modelled vertices, numbered through.
class Expectation {
 public:
  Expectation(Eigen::MatrixXd log_depths, Smoothing smoothing, const TissueModelOptions& options)
      : log_depths_(std::move(log_depths)), smoothing_(std::move(smoothing)), options_(options) {
    const Index subjects = log_depths_.cols();
    const Index modes = std::min<Index>(options.modes, subjects - 2);
    // Principal components round the medians give a start, with the median in the gaps and nothing
    // far from it: an outlier that made a mode of its own would never be doubted.
    Eigen::MatrixXd filled = Eigen::MatrixXd::Zero(log_depths_.rows(), subjects);
    Eigen::VectorXd medians(log_depths_.rows());
    for (Index v = 0; v < medians.size(); ++v) {
      const Spread spread = spread_of(log_depths_.row(v));
      medians[v] = spread.median;
      for (Index n = 0; n < subjects; ++n) {
        if (seen(v, n)) {
          filled(v, n) =
              std::clamp(log_depths_(v, n) - spread.median, -2.0 * spread.sd, 2.0 * spread.sd);
        }
      }
    }
    mean_ = smoothing_(medians);
    const SymmetricSpectrum gram = symmetric_spectrum(filled.transpose() * filled);
    scores_ = gram.vectors.rowwise().reverse().leftCols(modes).transpose() *
              std::sqrt(static_cast<double>(subjects));
    seconds_.assign(static_cast<std::size_t>(subjects), {});
    for (Index n = 0; n < subjects; ++n) {
      seconds_[static_cast<std::size_t>(n)] = scores_.col(n) * scores_.col(n).transpose();
    }
    modes_ = Eigen::MatrixXd::Zero(log_depths_.rows(), modes);
    noise_variance_ = Eigen::VectorXd::Constant(log_depths_.rows(), 1.0);
    weights_ = Eigen::MatrixXd::Ones(log_depths_.rows(), subjects);
  }

  void run() {
    for (int i = 0; i < options_.iterations; ++i) {
      fit_vertices();
      if (i > 0) doubt_outliers();
      fit_subjects();
    }
    fit_vertices();
    // From the scale of Student's t to the standard deviation of those that are no outliers.
    const Eigen::VectorXd scale = noise_variance_;
    set_noise([&](Index v, Index n) {
      return expected_square(v, n) < outlier_scales * outlier_scales * scale[v] ? 1.0 : 0.0;
    });
  }

  /// Modes as principal axes, largest first.
  Eigen::MatrixXd principal_modes() const {
    // The scores' own covariance may have drifted from the identity: it goes into the modes.
    Eigen::MatrixXd spread = Eigen::MatrixXd::Zero(modes_.cols(), modes_.cols());
    for (const Eigen::MatrixXd& second : seconds_) spread += second;
    spread /= static_cast<double>(seconds_.size());
    const Eigen::MatrixXd scaled =
        modes_ * Eigen::LLT<Eigen::MatrixXd>(spread).matrixL().toDenseMatrix();
    const SymmetricSpectrum axes = symmetric_spectrum(scaled.transpose() * scaled);
    Eigen::MatrixXd principal = scaled * axes.vectors.rowwise().reverse();
    for (Index k = 0; k < principal.cols(); ++k) {
      if (principal.col(k).sum() < 0.0) principal.col(k) = -principal.col(k);
    }
    return principal;
  }

  const Eigen::VectorXd& mean() const { return mean_; }
  const Eigen::VectorXd& noise_variance() const { return noise_variance_; }

 private:
  bool seen(Index v, Index n) const { return !std::isnan(log_depths_(v, n)); }

  /// Mean, modes and noise of each vertex by regression on the subjects' scores.
  void fit_vertices() {
    const Index modes = modes_.cols();
    for (Index v = 0; v < mean_.size(); ++v) {
      Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(modes + 1, modes + 1);
      Eigen::VectorXd right = Eigen::VectorXd::Zero(modes + 1);
      normal.diagonal().head(modes).setConstant(least_information);
      for (Index n = 0; n < log_depths_.cols(); ++n) {
        if (!seen(v, n)) continue;
        const double w = weights_(v, n);
        normal.topLeftCorner(modes, modes) += w * seconds_[static_cast<std::size_t>(n)];
        normal.topRightCorner(modes, 1) += w * scores_.col(n);
        normal(modes, modes) += w;
        right.head(modes) += w * log_depths_(v, n) * scores_.col(n);
        right[modes] += w * log_depths_(v, n);
      }
      normal.bottomLeftCorner(1, modes) = normal.topRightCorner(modes, 1).transpose();
      const Eigen::VectorXd solution = Eigen::LDLT<Eigen::MatrixXd>(normal).solve(right);
      modes_.row(v) = solution.head(modes);
      mean_[v] = solution[modes];
    }
    mean_ = smoothing_(mean_);
    // The scale of Student's t, drawn towards the surface's common one where subjects are few.
    set_noise([&](Index v, Index n) { return weights_(v, n); });
  }

  /// Noise variances: mean of weight times squared residual over the entries of positive weight.
  template <class Weight>
  void set_noise(const Weight& weight) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(mean_.size());
    Eigen::VectorXd count = Eigen::VectorXd::Zero(mean_.size());
    for (Index v = 0; v < mean_.size(); ++v) {
      for (Index n = 0; n < log_depths_.cols(); ++n) {
        if (!seen(v, n) || !(weight(v, n) > 0.0)) continue;
        sum[v] += weight(v, n) * expected_square(v, n);
        count[v] += 1.0;
      }
    }
    const double common = sum.sum() / count.sum();
    const double k = options_.shrinkage_count;
    noise_variance_ =
        ((sum.array() + k * common) / (count.array() + k)).max(least_noise_sd * least_noise_sd);
  }

  /// Of the residual, the scores' uncertainty included.
  double expected_square(Index v, Index n) const {
    const Eigen::RowVectorXd row = modes_.row(v);
    const double error = log_depths_(v, n) - mean_[v];
    const double along = row.dot(scores_.col(n));
    const double second = row * seconds_[static_cast<std::size_t>(n)] * row.transpose();
    return error * error - 2.0 * error * along + second;
  }

  void doubt_outliers() {
    const double nu = options_.degrees_of_freedom;
    for (Index n = 0; n < log_depths_.cols(); ++n) {
      for (Index v = 0; v < mean_.size(); ++v) {
        if (seen(v, n)) {
          weights_(v, n) = (nu + 1.0) / (nu + expected_square(v, n) / noise_variance_[v]);
        }
      }
    }
  }

  void fit_subjects() {
    const Index modes = modes_.cols();
    for (Index n = 0; n < log_depths_.cols(); ++n) {
      Eigen::MatrixXd information = Eigen::MatrixXd::Identity(modes, modes);
      Eigen::VectorXd pull = Eigen::VectorXd::Zero(modes);
      for (Index v = 0; v < mean_.size(); ++v) {
        if (!seen(v, n)) continue;
        const double precision = weights_(v, n) / noise_variance_[v];
        information.noalias() += precision * modes_.row(v).transpose() * modes_.row(v);
        pull.noalias() += precision * (log_depths_(v, n) - mean_[v]) * modes_.row(v).transpose();
      }
      const Eigen::LLT<Eigen::MatrixXd> factor(information);
      scores_.col(n) = factor.solve(pull);
      seconds_[static_cast<std::size_t>(n)] = scores_.col(n) * scores_.col(n).transpose() +
                                              factor.solve(Eigen::MatrixXd::Identity(modes, modes));
    }
  }

  Eigen::MatrixXd log_depths_;  // #modelled vertices x #subjects, NaN: not measured
  Smoothing smoothing_;
  TissueModelOptions options_;
  Eigen::VectorXd mean_;
  Eigen::MatrixXd modes_;
  Eigen::VectorXd noise_variance_;
  Eigen::MatrixXd weights_;               // of each entry: Student's t
  Eigen::MatrixXd scores_;                // #modes x #subjects: E[z]
  std::vector<Eigen::MatrixXd> seconds_;  // of each subject: E[z z^T]
};

Eigen::VectorXd where_modelled(const TissueModel& model, const Eigen::VectorXd& values) {
  Eigen::VectorXd result = values;
  for (Index v = 0; v < result.size(); ++v) {
    if (!model.modelled[static_cast<std::size_t>(v)]) result[v] = not_a_number;
  }
  return result;
}

/// Of the logarithm, #V: from the belief's covariance and from the noise.
Eigen::VectorXd log_variance(const TissueModel& model, const Belief& belief) {
  const Eigen::MatrixXd root = Eigen::LLT<Eigen::MatrixXd>(belief.covariance).matrixL();
  return (model.modes * root).rowwise().squaredNorm() + model.noise_sd.cwiseAbs2();
}

}  // namespace

Result<void> TissueModel::validate() const {
  const Index vertices = log_mean.size();
  if (vertices == 0 || count.size() != vertices || mean_mm.size() != vertices ||
      sd_mm.size() != vertices || static_cast<Index>(modelled.size()) != vertices ||
      modes.rows() != vertices || noise_sd.size() != vertices) {
    return bad("its tables are not of one length");
  }
  if (!log_mean.allFinite() || !modes.allFinite() || !noise_sd.allFinite() ||
      noise_sd.minCoeff() < 0.0) {
    return bad("a number in it is none");
  }
  return {};
}

Result<void> TissueModelOptions::validate() const {
  if (modes < 1) return bad("modes must be at least 1");
  if (least_count < 2) return bad("least_count must be at least 2");
  if (!(shrinkage_count >= 0.0)) return bad("shrinkage_count must not be negative");
  if (!(degrees_of_freedom > 0.0)) return bad("degrees_of_freedom must be positive");
  if (iterations < 1) return bad("iterations must be at least 1");
  return {};
}

Result<TissueModel> build_tissue_model(const Eigen::MatrixXd& depths_mm,
                                       const TriangleMesh& surface,
                                       const TissueModelOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  const Index vertices = depths_mm.rows();
  if (depths_mm.cols() < 3) return bad("needs at least 3 subjects", "add subjects");
  if (surface.vertices.rows() != vertices) {
    return bad(fmt::format("depths of {} vertices for a surface of {}", vertices,
                           surface.vertices.rows()));
  }
  if ((depths_mm.array() < 0.0).any() || depths_mm.array().isInf().any()) {
    return bad("a depth is negative or infinite");
  }
  TissueModel model;
  model.count = depths_mm.array()
                    .isNaN()
                    .select(0, Eigen::ArrayXXi::Ones(vertices, depths_mm.cols()))
                    .rowwise()
                    .sum();
  model.mean_mm = Eigen::VectorXd::Constant(vertices, not_a_number);
  model.sd_mm = model.mean_mm;
  model.modelled.assign(static_cast<std::size_t>(vertices), false);
  std::vector<Index> used;
  for (Index v = 0; v < vertices; ++v) {
    const double n = model.count[v];
    double sum = 0.0;
    double square_sum = 0.0;
    for (Index i = 0; i < depths_mm.cols(); ++i) {
      const double depth = depths_mm(v, i);
      if (std::isnan(depth)) continue;
      sum += depth;
      square_sum += depth * depth;
    }
    if (n > 0) model.mean_mm[v] = sum / n;
    if (n > 1) {
      model.sd_mm[v] = std::sqrt(std::max(0.0, (square_sum - sum * sum / n) / (n - 1.0)));
    }
    if (n >= options.least_count) {
      model.modelled[static_cast<std::size_t>(v)] = true;
      used.push_back(v);
    }
  }
  if (used.empty()) {
    return bad(fmt::format("no vertex was measured in {} subjects or more", options.least_count),
               "add subjects");
  }
  const auto used_count = static_cast<Index>(used.size());
  Eigen::MatrixXd used_depths(used_count, depths_mm.cols());
  for (Index i = 0; i < used_count; ++i) {
    for (Index n = 0; n < depths_mm.cols(); ++n) {
      const double depth = depths_mm(used[static_cast<std::size_t>(i)], n);
      used_depths(i, n) =
          std::isnan(depth) ? not_a_number : std::log(std::max(depth, kThinnestTissue_mm));
    }
  }
  const Eigen::VectorXi used_counts = model.count(used);
  Expectation expectation(std::move(used_depths),
                          Smoothing(used_counts, renumbered(surface.triangles, used, vertices),
                                    options.shrinkage_count),
                          options);
  expectation.run();
  const Eigen::MatrixXd modes = expectation.principal_modes();
  model.log_mean = Eigen::VectorXd::Zero(vertices);
  model.modes = Eigen::MatrixXd::Zero(vertices, modes.cols());
  model.noise_sd = Eigen::VectorXd::Zero(vertices);
  for (std::size_t i = 0; i < used.size(); ++i) {
    const auto row = static_cast<Index>(i);
    model.log_mean[used[i]] = expectation.mean()[row];
    model.modes.row(used[i]) = modes.row(row);
    model.noise_sd[used[i]] = std::sqrt(expectation.noise_variance()[row]);
  }
  return model;
}

Belief tissue_belief(const TissueModel& model, const Eigen::VectorXd& depths_mm) {
  Eigen::MatrixXd information = Eigen::MatrixXd::Identity(model.mode_count(), model.mode_count());
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(model.mode_count());
  for (Index v = 0; v < model.vertex_count(); ++v) {
    if (!model.modelled[static_cast<std::size_t>(v)] || std::isnan(depths_mm[v])) continue;
    const double precision = 1.0 / (model.noise_sd[v] * model.noise_sd[v]);
    const double error = std::log(std::max(depths_mm[v], kThinnestTissue_mm)) - model.log_mean[v];
    information.noalias() += precision * model.modes.row(v).transpose() * model.modes.row(v);
    pull.noalias() += precision * error * model.modes.row(v).transpose();
  }
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  return {factor.solve(pull),
          factor.solve(Eigen::MatrixXd::Identity(model.mode_count(), model.mode_count()))};
}

Eigen::VectorXd tissue_at(const TissueModel& model, const Eigen::VectorXd& coefficients) {
  const Index count = std::min(coefficients.size(), model.mode_count());
  const Eigen::VectorXd log_depth =
      model.log_mean + model.modes.leftCols(count) * coefficients.head(count);
  return where_modelled(model, log_depth.array().exp());
}

Eigen::VectorXd expected_tissue(const TissueModel& model, const Belief& belief) {
  const Eigen::VectorXd log_depth = model.log_mean + model.modes * belief.mean;
  return where_modelled(model, (log_depth + 0.5 * log_variance(model, belief)).array().exp());
}

double mean_depth_error_mm(const TissueModel& model, const Eigen::VectorXd& foretold_mm,
                           const Eigen::VectorXd& truth_mm) {
  double sum = 0.0;
  double count = 0.0;
  for (Index v = 0; v < truth_mm.size(); ++v) {
    if (!model.modelled[static_cast<std::size_t>(v)] || std::isnan(truth_mm[v])) continue;
    sum += std::abs(foretold_mm[v] - truth_mm[v]);
    ++count;
  }
  return sum / std::max(1.0, count);
}

Eigen::VectorXd tissue_sd_mm(const TissueModel& model, const Belief& belief) {
  const Eigen::ArrayXd variance = log_variance(model, belief).array();
  return where_modelled(model,
                        expected_tissue(model, belief).array() * (variance.exp() - 1.0).sqrt());
}

Belief population_tissue(const TissueModel& model) {
  return Belief::standard_normal(model.mode_count());
}

}  // namespace skullstation
