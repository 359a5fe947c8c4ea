#include "reconstruction/templates/tetrahedralization.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Labeled_mesh_domain_3.h>
#include <CGAL/Mesh_complex_3_in_triangulation_3.h>
#include <CGAL/Mesh_criteria_3.h>
#include <CGAL/Mesh_triangulation_3.h>
#include <CGAL/Random.h>
#include <CGAL/make_mesh_3.h>

#include <exception>
#include <map>
#include <vector>

namespace skullstation {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Domain = CGAL::Labeled_mesh_domain_3<Kernel>;
using Triangulation = CGAL::Mesh_triangulation_3<Domain>::type;
using Complex = CGAL::Mesh_complex_3_in_triangulation_3<Triangulation>;
using Criteria = CGAL::Mesh_criteria_3<Triangulation>;
namespace words = CGAL::parameters;

Eigen::Vector3d plain(const Kernel::Point_3& p) {
  return {CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z())};
}

/// Mesh_3 bounds circumradii: an equilateral triangle's is edge / sqrt(3), and refinement stops at
/// triangles somewhat smaller than the bound.
struct Sizing {
  using FT = Kernel::FT;
  using Point_3 = Kernel::Point_3;
  using Index = Domain::Index;
  const std::function<double(const Eigen::Vector3d&)>* edge_mm = nullptr;
  double factor = 1.0;
  FT operator()(const Point_3& p, int, const Index&) const { return factor * (*edge_mm)(plain(p)); }
};

TetrahedralMesh plain(const Complex& complex) {
  std::map<Triangulation::Vertex_handle, int> number;
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector4i> cells;
  for (auto cell = complex.cells_in_complex_begin(); cell != complex.cells_in_complex_end();
       ++cell) {
    Eigen::Vector4i corners;
    for (int i = 0; i < 4; ++i) {
      const auto vertex = cell->vertex(i);
      const auto [place, added] = number.try_emplace(vertex, static_cast<int>(points.size()));
      if (added) {
        const auto& p = vertex->point();
        points.emplace_back(CGAL::to_double(p.x()), CGAL::to_double(p.y()), CGAL::to_double(p.z()));
      }
      corners[i] = place->second;
    }
    cells.push_back(corners);
  }
  TetrahedralMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(points.size()), 3);
  for (std::size_t i = 0; i < points.size(); ++i) {
    mesh.vertices.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  }
  mesh.tetrahedra.resize(static_cast<Eigen::Index>(cells.size()), 4);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    mesh.tetrahedra.row(static_cast<Eigen::Index>(i)) = cells[i].transpose();
  }
  return mesh;
}

}  // namespace

Result<TetrahedralMesh> tetrahedralize(const TetrahedralizationOptions& options) {
  try {
    CGAL::Random random(1);
    const auto label = [&](const Kernel::Point_3& p) {
      return options.distance_mm(plain(p)) < 0.0 ? 1 : 0;
    };
    const Eigen::Vector3d center = options.box.center();
    const double radius = 0.5 * options.box.diagonal().norm() + 1.0;
    const Kernel::Sphere_3 ball(Kernel::Point_3(center.x(), center.y(), center.z()),
                                radius * radius);
    const Domain domain(words::function = label, words::bounding_object = ball,
                        words::p_rng = &random, words::relative_error_bound = 1e-5);
    const Sizing facet_size{&options.edge_mm, 0.75};
    const Sizing facet_distance{&options.edge_mm, 0.08};
    const Sizing cell_size{&options.edge_mm, 1.5};
    const Criteria criteria(words::facet_angle = 22.0, words::facet_size = facet_size,
                            words::facet_distance = facet_distance,
                            words::cell_radius_edge_ratio = 2.5, words::cell_size = cell_size);
    const Complex complex = CGAL::make_mesh_3<Complex>(domain, criteria, words::no_perturb(),
                                                       words::exude(words::sliver_bound = 8.0));
    TetrahedralMesh mesh = plain(complex);
    if (mesh.tetrahedra.rows() == 0) {
      return fail(ErrorKind::no_result, "tetrahedra", "nothing is inside the solid");
    }
    return mesh;
  } catch (const std::exception& error) {
    return fail(ErrorKind::no_result, "tetrahedra", error.what());
  }
}

}  // namespace skullstation
