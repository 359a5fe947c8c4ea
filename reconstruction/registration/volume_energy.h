#pragma once

#include <Eigen/SparseCore>

#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// L = 1/V sum over tetrahedra of V_T G_T G_T' (#V x #V): tr(U' L U) is the mean squared gradient
/// of a displacement.
Eigen::SparseMatrix<double> laplace_matrix(const Tetrahedra& tetrahedra, const Points3& rest);

/// The projected volume term (ShapeOp, Deuss et al. 2015): 1/V sum V_T |F_T - P(F_T)|^2 with F the
/// deformation gradient from `rest` to `rest + displacement` and P its nearest matrix of
/// determinant
/// 1. With P held, it is minimal for a displacement U with L U = the pull that is given here (#V x
/// 3).
Points3 volume_projection_pull(const Tetrahedra& tetrahedra, const Points3& rest,
                               const Points3& displacement, int threads);

/// The nearest matrix of determinant 1 (Frobenius norm): the singular values are moved onto the
/// surface where their product is 1.
Eigen::Matrix3d nearest_of_unit_determinant(const Eigen::Matrix3d& matrix);

/// Minimises the paper's energy, sum_v w_v |u_v - t_v|^2 + regularization sum_T (vol(T) -
/// vol_rest(T))^2 [mm^6] (Gietzen et al. 2019), by Gauss-Newton steps with conjugate gradients, and
/// gives the displacement from `rest` (#V x 3).
Points3 solve_volume_energy(const Tetrahedra& tetrahedra, const Points3& rest,
                            const Eigen::VectorXd& weights, const Points3& targets,
                            double regularization, const Points3& start);

}  // namespace skullstation
