#include "core/triangle_mesh.h"

namespace skullstation {

namespace {

/// Normal of triangle `f` with the length of twice its area.
Eigen::Vector3d doubled_area_normal(const TriangleMesh& mesh, Eigen::Index f) {
  const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
  const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
  const Eigen::Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
  return (b - a).cross(c - a);
}

}  // namespace

Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh) {
  Eigen::AlignedBox3d box;
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    box.extend(Eigen::Vector3d(mesh.vertices.row(v)));
  }
  return box;
}

Points3 vertex_normals(const TriangleMesh& mesh) {
  Points3 normals = Points3::Zero(mesh.vertices.rows(), 3);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const Eigen::Vector3d normal = doubled_area_normal(mesh, f);
    for (int corner = 0; corner < 3; ++corner) {
      normals.row(mesh.triangles(f, corner)) += normal.transpose();
    }
  }
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    const double length = normals.row(v).norm();
    if (length > 0.0) normals.row(v) /= length;
  }
  return normals;
}

double surface_area(const TriangleMesh& mesh) {
  double area = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    area += 0.5 * doubled_area_normal(mesh, f).norm();
  }
  return area;
}

Eigen::VectorXd vertex_areas(const TriangleMesh& mesh) {
  Eigen::VectorXd areas = Eigen::VectorXd::Zero(mesh.vertices.rows());
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const double third = doubled_area_normal(mesh, f).norm() / 6.0;
    for (int k = 0; k < 3; ++k) areas[mesh.triangles(f, k)] += third;
  }
  return areas;
}

}  // namespace skullstation
