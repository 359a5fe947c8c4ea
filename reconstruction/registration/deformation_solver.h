#pragma once

#include <memory>

#include "core/triangle_mesh.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// Finds the displacement U (#V x 3) of a tetrahedral mesh that minimises
///   sum_v w_v |u_v - t_v|^2 + smooth tr(U' H U) + volume tr(U' L U) - 2 tr(U' X):
/// weighted targets t, smoothness_matrix() H, laplace_matrix() L, and a pull X of other energies.
/// One scalar sparse system for all three coordinates: its pattern is analysed once (CHOLMOD), a
/// factor is made for each stiffness and preconditions conjugate gradients while weights change.
/// The same bytes for any number of threads.
struct DeformationTargets {
  Eigen::VectorXd weight;  ///< #V, not negative
  Points3 displacement;    ///< #V x 3: t
  /// #V x 3, unit, or zero where a target holds in all directions: S = n n' + along (1 - n n').
  Points3 normal;
  double along = 1.0;  ///< in (0, 1]
};

class DeformationSolver {
 public:
  explicit DeformationSolver(const SkullTemplate& skull);
  ~DeformationSolver();
  DeformationSolver(DeformationSolver&&) noexcept;
  DeformationSolver& operator=(DeformationSolver&&) noexcept;

  /// Makes the factor: smoothness [mm^4; its fourth root is a length], volume weight, and the
  /// weights (#V, positive) that are in force now.
  void stiffen(double smooth_mm4, double volume, const Eigen::VectorXd& weights);

  /// The displacement, from `start` (#V x 3). `pull` may have 0 rows: none.
  Points3 solve(const DeformationTargets& targets, const Points3& pull, const Points3& start) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace skullstation
