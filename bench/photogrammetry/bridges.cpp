#include "bench/photogrammetry/bridges.h"

#include <Eigen/Geometry>
#include <algorithm>

#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {

namespace {

struct Corners {
  Eigen::Vector3d a, b, c;

  Corners(const TriangleMesh& mesh, Eigen::Index f)
      : a(mesh.vertices.row(mesh.triangles(f, 0))),
        b(mesh.vertices.row(mesh.triangles(f, 1))),
        c(mesh.vertices.row(mesh.triangles(f, 2))) {}
  Eigen::Vector3d middle() const { return (a + b + c) / 3.0; }
  double area() const { return 0.5 * (b - a).cross(c - a).norm(); }
};

std::vector<double> distances_mm(const TriangleMesh& surface, const TriangleMesh& truth,
                                 int threads) {
  constexpr int kBatch = 1000;
  const TriangleBvh tree(truth);
  const auto count = static_cast<int>(surface.triangles.rows());
  std::vector<double> distance(count);
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    for (int f = batch * kBatch; f < std::min(count, (batch + 1) * kBatch); ++f) {
      distance[f] = tree.closest(Corners(surface, f).middle()).distance_mm;
    }
  });
  return distance;
}

}  // namespace

std::vector<Bridge> find_bridges(const TriangleMesh& surface, const TriangleMesh& truth,
                                 double least_mm, int threads) {
  const std::vector<double> all = distances_mm(surface, truth, threads);
  std::vector<double> distance;  // of those that are kept
  const TriangleMesh away = submesh(surface, [&](Eigen::Index f) { return all[f] > least_mm; });
  std::copy_if(all.begin(), all.end(), std::back_inserter(distance),
               [&](double mm) { return mm > least_mm; });
  const std::vector<int> patch = component_of_triangles(away);
  const int count = patch.empty() ? 0 : *std::max_element(patch.begin(), patch.end()) + 1;
  std::vector<Bridge> bridges(count);
  for (Eigen::Index f = 0; f < away.triangles.rows(); ++f) {
    const Corners corners(away, f);
    Bridge& bridge = bridges[patch[f]];
    bridge.area_cm2 += corners.area() / 100.0;
    bridge.most_mm = std::max(bridge.most_mm, distance[f]);
    bridge.middle_mm += corners.middle() * corners.area() / 100.0;
  }
  for (Bridge& bridge : bridges) bridge.middle_mm /= std::max(bridge.area_cm2, 1e-12);
  std::sort(bridges.begin(), bridges.end(),
            [](const Bridge& a, const Bridge& b) { return a.area_cm2 > b.area_cm2; });
  return bridges;
}

}  // namespace skullstation
