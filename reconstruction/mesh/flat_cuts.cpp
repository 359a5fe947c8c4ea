#include "reconstruction/mesh/flat_cuts.h"

#include <Eigen/Geometry>
#include <vector>

#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {

namespace {

constexpr double kFlat_mm = 0.4;
constexpr double kLeastCosine = 0.98;

}  // namespace

TriangleMesh opened_at_flat_cuts(const TriangleMesh& mesh, double least_area_mm2) {
  std::vector<bool> lid(static_cast<std::size_t>(mesh.triangles.rows()), false);
  if (mesh.vertices.rows() == 0) return mesh;
  double lids_mm2 = 0.0;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const Eigen::VectorXd height = side * mesh.vertices.col(axis);
      const double utmost = height.maxCoeff();
      std::vector<Eigen::Index> flat;
      double area_mm2 = 0.0;
      for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
        const auto corner = [&](int k) {
          return Eigen::Vector3d(mesh.vertices.row(mesh.triangles(t, k)));
        };
        const double lowest = height(mesh.triangles.row(t)).minCoeff();
        if (lowest < utmost - kFlat_mm) continue;
        const Eigen::Vector3d twice = (corner(1) - corner(0)).cross(corner(2) - corner(0));
        if (side * twice[axis] < kLeastCosine * twice.norm()) continue;
        flat.push_back(t);
        area_mm2 += 0.5 * twice.norm();
      }
      if (area_mm2 < least_area_mm2) continue;
      lids_mm2 += area_mm2;
      for (const Eigen::Index t : flat) lid[static_cast<std::size_t>(t)] = true;
    }
  }
  if (lids_mm2 > 0.5 * surface_area(mesh)) return mesh;
  return submesh(mesh, [&](Eigen::Index t) { return !lid[static_cast<std::size_t>(t)]; });
}

}  // namespace skullstation
