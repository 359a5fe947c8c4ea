#include "reconstruction/registration/head_led_by_skull.h"

#include <Eigen/LU>
#include <algorithm>
#include <vector>

namespace skullstation {

namespace {

constexpr int kNodes = 400;
/// How far a node may be missed for a smoother spline; more than the skull's correspondences err.
constexpr double kSmoothing_mm = 10.0;

/// Outer vertices spread over the bone: each is the one farthest from those before it.
std::vector<int> spread_nodes(const SkullTemplate& skull) {
  std::vector<int> outer;
  for (int v = 0; v < skull.boundary_count; ++v) {
    if (skull.outer[static_cast<std::size_t>(v)]) outer.push_back(v);
  }
  std::vector<int> nodes;
  Eigen::VectorXd away = Eigen::VectorXd::Constant(static_cast<Eigen::Index>(outer.size()), 1e9);
  while (nodes.size() < std::min<std::size_t>(kNodes, outer.size())) {
    Eigen::Index farthest = 0;
    away.maxCoeff(&farthest);
    nodes.push_back(outer[static_cast<std::size_t>(farthest)]);
    const Eigen::RowVector3d at = skull.vertices.row(nodes.back());
    for (Eigen::Index i = 0; i < away.size(); ++i) {
      away[i] = std::min(
          away[i], (skull.vertices.row(outer[static_cast<std::size_t>(i)]) - at).squaredNorm());
    }
  }
  return nodes;
}

}  // namespace

Points3 head_led_by_skull(const HeadTemplate& head, const SkullTemplate& skull,
                          const FittedSkull& fit) {
  const std::vector<int> nodes = spread_nodes(skull);
  const auto count = static_cast<Eigen::Index>(nodes.size());
  Points3 from(count, 3);
  Points3 to(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    from.row(i) = skull.vertices.row(nodes[static_cast<std::size_t>(i)]);
    to.row(i) = fit.vertices.row(nodes[static_cast<std::size_t>(i)]);
  }
  // Kernel and affine part. -r is the kernel of the thin-plate spline in space: positive definite
  // on what affine maps leave, so that the smoothing adds to its diagonal.
  Eigen::MatrixXd system = Eigen::MatrixXd::Zero(count + 4, count + 4);
  for (Eigen::Index i = 0; i < count; ++i) {
    system.row(i).head(count) = -(from.rowwise() - from.row(i)).rowwise().norm().transpose();
    system(i, i) = kSmoothing_mm;
    system(i, count) = system(count, i) = 1.0;
    system.block(i, count + 1, 1, 3) = from.row(i);
    system.block(count + 1, i, 3, 1) = from.row(i).transpose();
  }
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(count + 4, 3);
  right.topRows(count) = to;
  const Eigen::MatrixX3d solution = system.partialPivLu().solve(right);
  Points3 result(head.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < result.rows(); ++v) {
    const Eigen::RowVector3d at = head.vertices.row(v);
    Eigen::RowVectorXd basis(count + 4);
    basis.head(count) = -(from.rowwise() - at).rowwise().norm().transpose();
    basis[count] = 1.0;
    basis.tail(3) = at;
    result.row(v) = basis * solution;
  }
  return result;
}

}  // namespace skullstation
