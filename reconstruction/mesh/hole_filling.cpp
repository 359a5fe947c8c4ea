#include "reconstruction/mesh/hole_filling.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Polygon_mesh_processing/border.h>
#include <CGAL/Polygon_mesh_processing/orient_polygon_soup.h>
#include <CGAL/Polygon_mesh_processing/polygon_soup_to_polygon_mesh.h>
#include <CGAL/Polygon_mesh_processing/triangulate_hole.h>
#include <CGAL/Surface_mesh.h>

#include <Eigen/Geometry>
#include <array>
#include <iterator>
#include <numeric>

namespace skullstation {

namespace {

namespace pmp = CGAL::Polygon_mesh_processing;
using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

/// Remembers which vertex a copy is one of.
struct CopyVisitor : pmp::Default_orientation_visitor {
  std::vector<int>* origin = nullptr;
  void duplicated_vertex(std::size_t from, std::size_t) { origin->push_back((*origin)[from]); }
};

double rim_mm(const Mesh& mesh, Mesh::Halfedge_index start) {
  double length = 0.0;
  for (const Mesh::Halfedge_index h : CGAL::halfedges_around_face(start, mesh)) {
    length +=
        std::sqrt(CGAL::squared_distance(mesh.point(mesh.source(h)), mesh.point(mesh.target(h))));
  }
  return length;
}

TriangleMesh plain(const Mesh& mesh) {
  TriangleMesh out;
  out.vertices.resize(static_cast<Eigen::Index>(mesh.number_of_vertices()), 3);
  out.triangles.resize(static_cast<Eigen::Index>(mesh.number_of_faces()), 3);
  for (const Mesh::Vertex_index v : mesh.vertices()) {
    const Point& p = mesh.point(v);
    out.vertices.row(v.idx()) << p.x(), p.y(), p.z();
  }
  for (const Mesh::Face_index f : mesh.faces()) {
    int corner = 0;
    for (const Mesh::Vertex_index v : CGAL::vertices_around_face(mesh.halfedge(f), mesh)) {
      out.triangles(f.idx(), corner++) = static_cast<int>(v.idx());
    }
  }
  return out;
}

}  // namespace

FilledSurface fill_holes(const TriangleMesh& surface, double longest_rim_mm) {
  std::vector<Point> points;
  std::vector<std::array<std::size_t, 3>> triangles;
  for (Eigen::Index v = 0; v < surface.vertices.rows(); ++v) {
    points.emplace_back(surface.vertices(v, 0), surface.vertices(v, 1), surface.vertices(v, 2));
  }
  for (Eigen::Index f = 0; f < surface.triangles.rows(); ++f) {
    triangles.push_back({static_cast<std::size_t>(surface.triangles(f, 0)),
                         static_cast<std::size_t>(surface.triangles(f, 1)),
                         static_cast<std::size_t>(surface.triangles(f, 2))});
  }
  FilledSurface filled;
  filled.origin.resize(points.size());
  std::iota(filled.origin.begin(), filled.origin.end(), 0);
  CopyVisitor visitor;
  visitor.origin = &filled.origin;
  pmp::orient_polygon_soup(points, triangles, CGAL::parameters::visitor(visitor));
  Mesh mesh;
  pmp::polygon_soup_to_polygon_mesh(points, triangles, mesh);
  const auto measured = static_cast<Eigen::Index>(mesh.number_of_faces());

  std::vector<Mesh::Halfedge_index> holes;
  pmp::extract_boundary_cycles(mesh, std::back_inserter(holes));
  for (const Mesh::Halfedge_index hole : holes) {
    std::vector<Mesh::Face_index> faces;
    std::vector<Mesh::Vertex_index> vertices;
    if (rim_mm(mesh, hole) <= longest_rim_mm) {
      pmp::triangulate_refine_and_fair_hole(mesh, hole, std::back_inserter(faces),
                                            std::back_inserter(vertices));
    }
    (faces.empty() ? filled.holes_left : filled.holes_filled) += 1;
  }
  filled.mesh = plain(mesh);
  filled.origin.resize(filled.mesh.vertices.rows(), -1);
  for (Eigen::Index f = measured; f < filled.mesh.triangles.rows(); ++f) {
    const Eigen::Vector3d a = filled.mesh.vertices.row(filled.mesh.triangles(f, 0));
    const Eigen::Vector3d b = filled.mesh.vertices.row(filled.mesh.triangles(f, 1));
    const Eigen::Vector3d c = filled.mesh.vertices.row(filled.mesh.triangles(f, 2));
    filled.filled_mm2 += 0.5 * (b - a).cross(c - a).norm();
  }
  return filled;
}

}  // namespace skullstation
