#include "reconstruction/statistics/shape_model.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"

namespace skullstation {

namespace {

tl::unexpected<Error> bad(const char* where, std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, where, std::move(what), std::move(advice));
}

/// Columns made orthonormal in the plain inner product, with the same covariance `scaled scaled^T`:
/// modes and variances of it, largest first.
void orthonormalize(const Eigen::MatrixXd& scaled, ShapeModel& model) {
  const SymmetricSpectrum small = symmetric_spectrum(scaled.transpose() * scaled);
  const Eigen::Index count = scaled.cols();
  model.variances = small.values.reverse();
  model.modes = scaled * small.vectors.rowwise().reverse();
  for (Eigen::Index k = 0; k < count; ++k) {
    model.modes.col(k) /= std::sqrt(model.variances[k]);
    // The sign is free: the coordinate that moves most moves in the positive direction.
    Eigen::Index most = 0;
    model.modes.col(k).cwiseAbs().maxCoeff(&most);
    if (model.modes(most, k) < 0.0) model.modes.col(k) = -model.modes.col(k);
  }
}

}  // namespace

ShapeModel shape_model_of(const Eigen::VectorXd& mean, const Eigen::MatrixXd& scaled_modes,
                          double noise_variance) {
  ShapeModel model;
  model.mean = mean;
  model.noise_variance = noise_variance;
  orthonormalize(scaled_modes, model);
  return model;
}

Eigen::MatrixXd ShapeModel::scaled_modes() const {
  return modes * variances.cwiseSqrt().asDiagonal();
}

Result<void> ShapeModel::validate() const {
  const auto unsound = [](std::string what) { return bad("shape model", std::move(what)); };
  if (mean.size() == 0 || mean.size() % 3 != 0) return unsound("its mean is not made of points");
  if (modes.rows() != mean.size() || modes.cols() != variances.size()) {
    return unsound(fmt::format("{} x {} modes for {} coordinates and {} variances", modes.rows(),
                               modes.cols(), mean.size(), variances.size()));
  }
  if (!mean.allFinite() || !modes.allFinite() || !variances.allFinite() ||
      !(noise_variance >= 0.0)) {
    return unsound("a number in it is none");
  }
  if (variances.size() > 0 && variances.minCoeff() <= 0.0) {
    return unsound("a mode has no variance");
  }
  return {};
}

Eigen::VectorXd flattened(const Points3& vertices) {
  return Eigen::Map<const Eigen::VectorXd>(vertices.data(), vertices.size());
}

Points3 unflattened(const Eigen::VectorXd& coordinates) {
  return Eigen::Map<const Points3>(coordinates.data(), coordinates.size() / 3, 3);
}

Result<void> ShapeModelOptions::validate() const {
  if (!(kept_variance > 0.0 && kept_variance <= 1.0)) {
    return bad("shape model, kept_variance", "must be above 0, up to 1");
  }
  if (max_modes < 1) return bad("shape model, max_modes", "must be at least 1");
  return {};
}

Result<ShapeModel> build_shape_model(std::span<const Points3> shapes,
                                     const Eigen::VectorXd& vertex_weights,
                                     const ShapeModelOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  const auto count = static_cast<Eigen::Index>(shapes.size());
  if (count < 3) return bad("shape model", "needs at least 3 shapes", "add subjects");
  const Eigen::Index vertices = shapes.front().rows();
  if (vertex_weights.size() != vertices || !(vertex_weights.minCoeff() >= 0.0) ||
      !(vertex_weights.sum() > 0.0)) {
    return bad("shape model", "needs one weight for each vertex, not negative, not all zero");
  }
  Eigen::MatrixXd centred(3 * vertices, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Points3& shape = shapes[static_cast<std::size_t>(i)];
    if (shape.rows() != vertices) {
      return bad("shape model", fmt::format("shape {} has {} vertices, the first has {}", i,
                                            shape.rows(), vertices));
    }
    if (!shape.allFinite()) {
      return bad("shape model", fmt::format("shape {} has a vertex that is not a number", i));
    }
    centred.col(i) = flattened(shape);
  }
  ShapeModel model;
  model.mean = centred.rowwise().mean();
  centred.colwise() -= model.mean;

  Eigen::VectorXd weights(3 * vertices);
  for (Eigen::Index v = 0; v < vertices; ++v) {
    weights.segment<3>(3 * v).setConstant(vertex_weights[v] / vertex_weights.sum());
  }
  const Eigen::MatrixXd gram = centred.transpose() * weights.asDiagonal() * centred;
  const SymmetricSpectrum solver = symmetric_spectrum(gram);
  // Centring takes one dimension away.
  const Eigen::VectorXd values = solver.values.reverse().head(count - 1).cwiseMax(0.0);
  const double total = values.sum();
  if (!(total > 0.0)) return bad("shape model", "all shapes are the same");
  Eigen::Index kept = 0;
  double explained = 0.0;
  while (kept < count - 1 && kept < options.max_modes && values[kept] > 1e-12 * total &&
         explained < options.kept_variance * total) {
    explained += values[kept++];
  }
  // Regression of the coordinates on the subjects' scores: vertices of weight 0 go along.
  const Eigen::MatrixXd scores = solver.vectors.rowwise().reverse().leftCols(kept);
  const double degrees = static_cast<double>(count - 1);
  orthonormalize(centred * scores / std::sqrt(degrees), model);

  const Eigen::MatrixXd left = centred - (centred * scores) * scores.transpose();
  const double coordinate_variance =
      (left.rowwise().squaredNorm().array() * weights.array()).sum() / (3.0 * degrees);
  model.noise_variance = coordinate_variance;
  return model;
}

Points3 shape_at(const ShapeModel& model, const Eigen::VectorXd& coefficients) {
  const Eigen::Index count = std::min(coefficients.size(), model.mode_count());
  const Eigen::VectorXd steps =
      coefficients.head(count).cwiseProduct(model.variances.head(count).cwiseSqrt());
  return unflattened(model.mean + model.modes.leftCols(count) * steps);
}

Eigen::VectorXd coefficients_of(const ShapeModel& model, const Points3& vertices) {
  const Eigen::VectorXd along = model.modes.transpose() * (flattened(vertices) - model.mean);
  return along.cwiseQuotient(model.variances.cwiseSqrt());
}

Belief population_belief(const ShapeModel& model) {
  return Belief::standard_normal(model.mode_count());
}

Belief updated(const ShapeModel& model, const Belief& prior,
               std::span<const VertexObservation> observations) {
  const Eigen::Index modes = model.mode_count();
  const Eigen::VectorXd sd = model.variances.cwiseSqrt();
  const Eigen::LLT<Eigen::MatrixXd> prior_factor(prior.covariance);
  Eigen::MatrixXd information = prior_factor.solve(Eigen::MatrixXd::Identity(modes, modes));
  Eigen::VectorXd pull = information * prior.mean;

  // In blocks, so that the products run as matrix products.
  constexpr std::size_t block = 256;
  for (std::size_t begin = 0; begin < observations.size(); begin += block) {
    const std::size_t end = std::min(observations.size(), begin + block);
    const auto rows = static_cast<Eigen::Index>(3 * (end - begin));
    Eigen::MatrixXd whitened(rows, modes);
    Eigen::VectorXd error(rows);
    for (std::size_t i = begin; i < end; ++i) {
      const VertexObservation& seen = observations[i];
      const double along =
          1.0 / std::sqrt(seen.along_sd_mm * seen.along_sd_mm + model.noise_variance);
      const double across =
          1.0 / std::sqrt(seen.across_sd_mm * seen.across_sd_mm + model.noise_variance);
      const Eigen::Matrix3d root = across * Eigen::Matrix3d::Identity() +
                                   (along - across) * seen.normal * seen.normal.transpose();
      const auto row = static_cast<Eigen::Index>(3 * (i - begin));
      whitened.middleRows<3>(row) =
          root * model.modes.middleRows<3>(3 * Eigen::Index{seen.vertex}) * sd.asDiagonal();
      error.segment<3>(row) =
          root * (seen.position_mm - model.mean.segment<3>(3 * Eigen::Index{seen.vertex}));
    }
    information.selfadjointView<Eigen::Lower>().rankUpdate(whitened.transpose());
    pull += whitened.transpose() * error;
  }
  information.triangularView<Eigen::StrictlyUpper>() = information.transpose();
  const Eigen::LLT<Eigen::MatrixXd> factor(information);
  return {factor.solve(pull), factor.solve(Eigen::MatrixXd::Identity(modes, modes))};
}

Eigen::VectorXd vertex_sd_mm(const ShapeModel& model, const Belief& belief) {
  const Eigen::VectorXd sd = model.variances.cwiseSqrt();
  const Eigen::MatrixXd root =
      sd.asDiagonal() * Eigen::LLT<Eigen::MatrixXd>(belief.covariance).matrixL().toDenseMatrix();
  const Eigen::VectorXd variances = (model.modes * root).rowwise().squaredNorm();
  Eigen::VectorXd result(model.vertex_count());
  for (Eigen::Index v = 0; v < result.size(); ++v) {
    result[v] = std::sqrt(variances.segment<3>(3 * v).mean());
  }
  return result;
}

Eigen::VectorXd sd_along_normals_mm(const ShapeModel& model, const Eigen::MatrixXd& covariance,
                                    const Points3& normals) {
  const Eigen::MatrixXd scaled = model.scaled_modes();
  Eigen::VectorXd sd(model.vertex_count());
  for (Eigen::Index v = 0; v < sd.size(); ++v) {
    const Eigen::RowVectorXd along = normals.row(v) * scaled.middleRows<3>(3 * v);
    sd[v] = std::sqrt(along * covariance * along.transpose() + model.noise_variance);
  }
  return sd;
}

double tikhonov_noise_sd_mm(double lambda, int points, int modes) {
  return std::sqrt(lambda * points / modes);
}

}  // namespace skullstation
