#include "reconstruction/photogrammetry/surface_cleaning.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <numeric>

namespace skullstation {

namespace {

/// Disjoint sets of vertices.
class Pieces {
 public:
  explicit Pieces(int count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  int find(int v) {
    while (parent_[v] != v) v = parent_[v] = parent_[parent_[v]];
    return v;
  }
  void join(int a, int b) {
    a = find(a);
    b = find(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<int> parent_;
};

double area_mm2(const TriangleMesh& mesh, Eigen::Index f) {
  const Eigen::Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
  const Eigen::Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
  const Eigen::Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
  return 0.5 * (b - a).cross(c - a).norm();
}

}  // namespace

Result<void> CleaningOptions::validate() const {
  if (least_piece_share >= 0.0 && least_piece_share <= 1.0) return {};
  return fail(ErrorKind::usage, "cleaning options", "least_piece_share is a share, 0 to 1");
}

FusedSurface selected_triangles(const FusedSurface& surface, const std::vector<bool>& kept) {
  const TriangleMesh& mesh = surface.mesh;
  std::vector<int> number(mesh.vertices.rows(), -1);
  Eigen::Index triangles = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    if (!kept[f]) continue;
    ++triangles;
    for (int k = 0; k < 3; ++k) number[mesh.triangles(f, k)] = 0;
  }
  int used = 0;
  for (int& v : number) v = v == 0 ? used++ : -1;
  FusedSurface out;
  out.mesh.vertices.resize(used, 3);
  out.mesh.triangles.resize(triangles, 3);
  out.weight.resize(used);
  if (mesh.normals.rows() > 0) out.mesh.normals.resize(used, 3);
  if (mesh.colors.rows() > 0) out.mesh.colors.resize(used, 3);
  for (std::size_t v = 0; v < number.size(); ++v) {
    const int to = number[v];
    if (to < 0) continue;
    const auto from = static_cast<Eigen::Index>(v);
    out.mesh.vertices.row(to) = mesh.vertices.row(from);
    out.weight[to] = surface.weight[v];
    if (mesh.normals.rows() > 0) out.mesh.normals.row(to) = mesh.normals.row(from);
    if (mesh.colors.rows() > 0) out.mesh.colors.row(to) = mesh.colors.row(from);
  }
  Eigen::Index next = 0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    if (!kept[f]) continue;
    for (int k = 0; k < 3; ++k) out.mesh.triangles(next, k) = number[mesh.triangles(f, k)];
    ++next;
  }
  return out;
}

FusedSurface without_small_pieces(const FusedSurface& surface, const CleaningOptions& options) {
  const TriangleMesh& mesh = surface.mesh;
  const auto count = static_cast<int>(mesh.vertices.rows());
  Pieces pieces(count);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    pieces.join(mesh.triangles(f, 0), mesh.triangles(f, 1));
    pieces.join(mesh.triangles(f, 1), mesh.triangles(f, 2));
  }
  std::vector<double> area(count, 0.0);
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    area[pieces.find(mesh.triangles(f, 0))] += area_mm2(mesh, f);
  }
  const double least =
      count == 0 ? 0.0 : options.least_piece_share * *std::max_element(area.begin(), area.end());
  std::vector<bool> kept(mesh.triangles.rows());
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    kept[f] = area[pieces.find(mesh.triangles(f, 0))] >= least;
  }
  return selected_triangles(surface, kept);
}

}  // namespace skullstation
