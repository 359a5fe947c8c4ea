#pragma once

#include <Eigen/SparseCore>

#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// The matrix H (#V x #V, symmetric, positive semi-definite) of the energy
/// trace(U' H U) = 1/V sum over inner faces of V_f |[grad U] / d_f|^2 ~ 1/V integral |Hessian U|^2
/// [1/mm^2] of a displacement U (#V x 3): the jump of its gradient across each face shared by two
/// tetrahedra, whose centroids are d_f apart across it. Affine displacements of a bone cost
/// nothing, so it bends nothing towards its rest at open ends; slivers are held together by it.
/// METHOD 5.1 compares such second-order energies with the volume terms.
Eigen::SparseMatrix<double> smoothness_matrix(const Tetrahedra& tetrahedra, const Points3& rest);

}  // namespace skullstation
