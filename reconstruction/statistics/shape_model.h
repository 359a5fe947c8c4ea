#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/statistics/belief.h"

namespace skullstation {

/// A Gaussian model of shapes in correspondence: x = mean + modes (sd .* b) + noise with
/// b ~ N(0, I). Coefficients b are in standard deviations throughout. Probabilistic principal
/// components (Tipping & Bishop 1999), laid out as Statismo and Scalismo have them.
struct ShapeModel {
  Eigen::VectorXd mean;         ///< 3 #V: x0 y0 z0 x1 ... [mm]
  Eigen::MatrixXd modes;        ///< 3 #V x #modes, orthonormal columns
  Eigen::VectorXd variances;    ///< #modes, descending [mm^2], of the coefficients along the modes
  double noise_variance = 0.0;  ///< of each coordinate, what the modes leave over [mm^2]

  Eigen::Index vertex_count() const { return mean.size() / 3; }
  Eigen::Index mode_count() const { return modes.cols(); }
  /// Modes times their standard deviations: 3 #V x #modes [mm].
  Eigen::MatrixXd scaled_modes() const;

  Result<void> validate() const;
};

/// The model whose shapes are the mean plus `scaled_modes` (3 #V x #modes [mm]) times standard
/// normal coefficients; its modes are made orthonormal.
ShapeModel shape_model_of(const Eigen::VectorXd& mean, const Eigen::MatrixXd& scaled_modes,
                          double noise_variance);

/// #V x 3 as one vector x0 y0 z0 x1 ... and back.
Eigen::VectorXd flattened(const Points3& vertices);
Points3 unflattened(const Eigen::VectorXd& coordinates);

struct ShapeModelOptions {
  /// Share of the (weighted) variance that the kept modes explain, at least.
  double kept_variance = 0.98;
  int max_modes = 1000;

  Result<void> validate() const;
};

/// Principal components of shapes that are in correspondence and lie in one frame; size is kept.
/// `vertex_weights` (#V, not negative; mostly the area around each vertex) make the choice of modes
/// independent of how densely the vertices lie; vertices of weight 0 go along without a say. By
/// the Gram matrix of the shapes, which is small. Fails with `bad_input` for fewer than 3 shapes,
/// unequal sizes, numbers that are none.
Result<ShapeModel> build_shape_model(std::span<const Points3> shapes,
                                     const Eigen::VectorXd& vertex_weights,
                                     const ShapeModelOptions& options = {});

/// The shape with the given coefficients [SD]; fewer than #modes: the others are 0.
Points3 shape_at(const ShapeModel& model, const Eigen::VectorXd& coefficients);

/// Coefficients [SD] of the shape nearest to `vertices` (least squares over all vertices).
Eigen::VectorXd coefficients_of(const ShapeModel& model, const Points3& vertices);

/// Where a vertex was seen. The error along the normal differs from that across it, since a
/// surface tells where it is, not which of its points is meant.
struct VertexObservation {
  int vertex = 0;
  Eigen::Vector3d position_mm = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();  ///< unit; zero: the error is `across_sd_mm`
  double along_sd_mm = 1.0;
  double across_sd_mm = 1.0;
};

/// Nothing known of the coefficients but the population.
Belief population_belief(const ShapeModel& model);

/// The belief after the observations: the posterior shape model (Albrecht et al. 2013). The
/// model's own noise adds to the observations'.
Belief updated(const ShapeModel& model, const Belief& prior,
               std::span<const VertexObservation> observations);

/// Standard deviation of each vertex (#V, root of the mean variance over x, y, z) [mm] under a
/// belief; the model's noise is not added.
Eigen::VectorXd vertex_sd_mm(const ShapeModel& model, const Belief& belief);

/// Standard deviation of each vertex along its unit normal (`normals`: #V x 3) [mm], the model's
/// noise included.
Eigen::VectorXd sd_along_normals_mm(const ShapeModel& model, const Eigen::MatrixXd& covariance,
                                    const Points3& normals);

/// The paper's Tikhonov weight (Gietzen et al. 2019) as the isotropic noise that makes the maximum
/// a posteriori the same: lambda / #modes sum (b / sd)^2 + 1 / #points sum |error|^2 [mm].
double tikhonov_noise_sd_mm(double lambda, int points, int modes);

}  // namespace skullstation
