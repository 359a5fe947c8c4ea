#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/statistics/belief.h"

namespace skullstation {

/// Statistics of soft tissue thickness over the surface vertices of the skull template. Raw figures
/// beside a Gaussian model of the logarithm: log t = log_mean + modes z + noise, z ~ N(0, I), which
/// knows how neighbours vary together and never gives a negative depth.
struct TissueModel {
  Eigen::VectorXi count;    ///< #V: subjects measured there
  Eigen::VectorXd mean_mm;  ///< #V: of those; NaN where count is 0
  Eigen::VectorXd sd_mm;    ///< #V: NaN where count is below 2

  std::vector<bool> modelled;  ///< #V: enough subjects, so that the model below means something
  Eigen::VectorXd log_mean;    ///< #V, of millimetres; 0 where not modelled
  Eigen::MatrixXd modes;       ///< #V x #modes, in log units per standard deviation
  Eigen::VectorXd noise_sd;    ///< #V, in log units: what the modes leave over

  Eigen::Index vertex_count() const { return log_mean.size(); }
  Eigen::Index mode_count() const { return modes.cols(); }

  Result<void> validate() const;
};

/// Thinner skin than this is not believed.
inline constexpr double kThinnestTissue_mm = 1.0;

struct TissueModelOptions {
  int modes = 6;
  int least_count = 5;              ///< subjects; vertices with fewer are not modelled
  double shrinkage_count = 3.0;     ///< subjects that each neighbour's mean is worth
  double degrees_of_freedom = 4.0;  ///< Student's t: how far outlying depths are doubted
  int iterations = 60;

  Result<void> validate() const;
};

/// The model of depths (#V x #subjects [mm], NaN: not measured), by expectation maximisation of
/// probabilistic principal components with missing entries (Tipping & Bishop 1999, section 4; Ilin
/// & Raiko 2010), each entry weighted by Student's t so that an ear or a tube in place of the skin
/// has no say. `surface` is the template's, for the shrinkage of means with few subjects towards
/// their surroundings. Deterministic. Fails with `bad_input` for fewer than 3 subjects, lengths
/// that differ, depths that are not positive.
Result<TissueModel> build_tissue_model(const Eigen::MatrixXd& depths_mm,
                                       const TriangleMesh& surface,
                                       const TissueModelOptions& options = {});

/// The coefficients of a subject whose depths (#V, NaN: not measured) were measured.
Belief tissue_belief(const TissueModel& model, const Eigen::VectorXd& depths_mm);

/// Depths (#V [mm], NaN where not modelled) for coefficients z, and the mean that the model expects
/// for the belief (back from the logarithm: exp(mean + variance / 2)).
Eigen::VectorXd tissue_at(const TissueModel& model, const Eigen::VectorXd& coefficients);
Eigen::VectorXd expected_tissue(const TissueModel& model, const Belief& belief);

/// Mean absolute error of foretold depths [mm], where the model and the truth (#V, NaN: not
/// measured) have any.
double mean_depth_error_mm(const TissueModel& model, const Eigen::VectorXd& foretold_mm,
                           const Eigen::VectorXd& truth_mm);

/// Standard deviation of the depths (#V [mm], NaN where not modelled) under a belief, the noise
/// included.
Eigen::VectorXd tissue_sd_mm(const TissueModel& model, const Belief& belief);

/// Nothing known but the population.
Belief population_tissue(const TissueModel& model);

}  // namespace skullstation
