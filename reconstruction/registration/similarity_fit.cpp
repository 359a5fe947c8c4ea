#include "reconstruction/registration/similarity_fit.h"

#include <Eigen/Geometry>
#include <cmath>

#include "core/linear_algebra.h"

namespace skullstation {

Result<Similarity3> fit_similarity(const Points3& source, const Points3& target,
                                   const Eigen::VectorXd& weights, FitScale scale) {
  const auto undetermined = [](const char* what) {
    return fail(ErrorKind::no_result, "similarity fit", what);
  };
  const Eigen::Index count = source.rows();
  const auto weight = [&](Eigen::Index i) { return weights.size() == 0 ? 1.0 : weights[i]; };

  double total = 0.0;
  Eigen::Vector3d source_center = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_center = Eigen::Vector3d::Zero();
  int weighted = 0;
  for (Eigen::Index i = 0; i < count; ++i) {
    total += weight(i);
    source_center += weight(i) * source.row(i).transpose();
    target_center += weight(i) * target.row(i).transpose();
    weighted += weight(i) > 0.0 ? 1 : 0;
  }
  if (weighted < 3) return undetermined("needs 3 points that correspond");
  source_center /= total;
  target_center /= total;

  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  Eigen::Matrix3d source_spread = Eigen::Matrix3d::Zero();
  double target_squares = 0.0;
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::Vector3d p = source.row(i).transpose() - source_center;
    const Eigen::Vector3d q = target.row(i).transpose() - target_center;
    moments += weight(i) * p * q.transpose();
    source_spread += weight(i) * p * p.transpose();
    target_squares += weight(i) * q.squaredNorm();
  }
  const Eigen::Vector3d spread = symmetric_spectrum(source_spread).values;
  if (!(spread[1] > 1e-12 * spread[2]) || !(target_squares > 0.0)) {
    return undetermined("the points lie on a line");
  }

  // The unit quaternion that maximises q' N q (Horn 1987, equation 26).
  const Eigen::Matrix3d& m = moments;
  Eigen::Matrix4d n;
  n << m(0, 0) + m(1, 1) + m(2, 2), m(1, 2) - m(2, 1), m(2, 0) - m(0, 2), m(0, 1) - m(1, 0), 0,
      m(0, 0) - m(1, 1) - m(2, 2), m(0, 1) + m(1, 0), m(2, 0) + m(0, 2), 0, 0,
      -m(0, 0) + m(1, 1) - m(2, 2), m(1, 2) + m(2, 1), 0, 0, 0, -m(0, 0) - m(1, 1) + m(2, 2);
  n.triangularView<Eigen::StrictlyLower>() = n.transpose();
  const SymmetricSpectrum spectrum = symmetric_spectrum(n);
  const Eigen::Vector4d q = spectrum.vectors.col(3);

  Similarity3 fit;
  fit.rotation = Eigen::Quaterniond(q[0], q[1], q[2], q[3]).normalized();
  if (scale == FitScale::to_target) fit.scale = spectrum.values[3] / source_spread.trace();
  if (scale == FitScale::symmetric) fit.scale = std::sqrt(target_squares / source_spread.trace());
  if (!(fit.scale > 0.0)) return undetermined("the points do not correspond");
  fit.translation = target_center - fit.scale * (fit.rotation * source_center);
  return fit;
}

TriangleMesh moved(const Similarity3& transform, TriangleMesh mesh) {
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    mesh.vertices.row(v) = (transform * mesh.vertices.row(v).transpose()).transpose();
  }
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

}  // namespace skullstation
