#include "reconstruction/mesh/vertex_clustering.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

namespace skullstation {

namespace {

/// Cells along the longest side of the bounding box, at most: three numbers fit into 64 bits.
constexpr double most_cells_a_side = 1e6;
/// A surface passes through 1.5 cells for each cell's side squared, over all directions; there are
/// two triangles to a vertex.
constexpr double triangles_a_cell_area = 3.0;

struct CellOfVertex {
  std::uint64_t cell = 0;
  int vertex = 0;
};

/// All vertices, those of a cell together, in the vertices' order.
std::vector<CellOfVertex> by_cell(const Points3& vertices, double cell_mm) {
  const Eigen::RowVector3d low = vertices.colwise().minCoeff();
  const Eigen::RowVector3d high = vertices.colwise().maxCoeff();
  const double side_mm = std::max(cell_mm, (high - low).maxCoeff() / most_cells_a_side);
  std::vector<CellOfVertex> cells(static_cast<std::size_t>(vertices.rows()));
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    std::uint64_t cell = 0;
    for (int axis = 0; axis < 3; ++axis) {
      const double place = std::floor((vertices(v, axis) - low[axis]) / side_mm);
      cell = cell << 21 | static_cast<std::uint64_t>(place);
    }
    cells[static_cast<std::size_t>(v)] = {cell, static_cast<int>(v)};
  }
  std::ranges::sort(cells, [](const CellOfVertex& a, const CellOfVertex& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.vertex < b.vertex;
  });
  return cells;
}

}  // namespace

TriangleMesh clustered(const TriangleMesh& mesh, double cell_mm) {
  TriangleMesh result;
  if (mesh.vertices.rows() == 0) return result;
  const std::vector<CellOfVertex> cells = by_cell(mesh.vertices, cell_mm);
  std::vector<int> cluster(cells.size());
  int count = 0;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0 && cells[i].cell != cells[i - 1].cell) ++count;
    cluster[static_cast<std::size_t>(cells[i].vertex)] = count;
  }
  ++count;
  result.vertices = Points3::Zero(count, 3);
  Eigen::VectorXd members = Eigen::VectorXd::Zero(count);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const int c = cluster[static_cast<std::size_t>(v)];
    result.vertices.row(c) += mesh.vertices.row(v);
    members[c] += 1.0;
  }
  result.vertices.array().colwise() /= members.array();

  const auto corner = [&](Eigen::Index t, int k) {
    return cluster[static_cast<std::size_t>(mesh.triangles(t, k))];
  };
  const auto is_left = [&](Eigen::Index t) {
    const int a = corner(t, 0), b = corner(t, 1), c = corner(t, 2);
    return a != b && b != c && c != a;
  };
  Eigen::Index left = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) left += is_left(t) ? 1 : 0;
  result.triangles.resize(left, 3);
  left = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    if (is_left(t)) result.triangles.row(left++) << corner(t, 0), corner(t, 1), corner(t, 2);
  }
  return result;
}

TriangleMesh thinned(TriangleMesh mesh, Eigen::Index most_triangles) {
  if (mesh.triangles.rows() <= most_triangles) return mesh;
  const double area_mm2 = surface_area(mesh);
  // What is no surface is for others to refuse.
  if (!(area_mm2 > 0.0) || !std::isfinite(area_mm2)) return mesh;
  return clustered(
      mesh, std::sqrt(triangles_a_cell_area * area_mm2 / static_cast<double>(most_triangles)));
}

}  // namespace skullstation
