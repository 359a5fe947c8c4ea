#include "reconstruction/photogrammetry/coverage.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {

namespace {

constexpr int kBatch = 4096;

/// Lengths of edges that belong to one triangle only.
double border_mm(const TriangleMesh& mesh) {
  const std::vector<std::array<bool, 3>> open = boundary_edges(mesh.triangles);
  double length = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int side = 0; side < 3; ++side) {
      if (!open[static_cast<std::size_t>(f)][static_cast<std::size_t>(side)]) continue;
      length += (mesh.vertices.row(mesh.triangles(f, side)) -
                 mesh.vertices.row(mesh.triangles(f, (side + 1) % 3)))
                    .norm();
    }
  }
  return length;
}

void for_each_vertex(const TriangleMesh& mesh, int threads, const std::function<void(int)>& work) {
  const auto count = static_cast<int>(mesh.vertices.rows());
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    const int end = std::min(count, (batch + 1) * kBatch);
    for (int v = batch * kBatch; v < end; ++v) work(v);
  });
}

}  // namespace

Coverage measure_coverage(const TriangleMesh& mesh, const Sights& sights,
                          std::vector<float> accuracy_mm, int threads) {
  const std::span<const StereoView> views = sights.views();
  const auto count = static_cast<std::size_t>(mesh.vertices.rows());
  Coverage coverage{std::vector<std::uint8_t>(count, 0), std::vector<float>(count, 0.0f),
                    std::move(accuracy_mm), border_mm(mesh)};
  for_each_vertex(mesh, threads, [&](int i) {
    int seen = 0;
    double finest = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const auto sight = sights.of(v, mesh.vertices.row(i), mesh.normals.row(i));
      if (!sight) continue;
      ++seen;
      const double pixel_mm = sight->depth_mm / views[v].camera.fx;
      finest = finest == 0.0 ? pixel_mm : std::min(finest, pixel_mm);
    }
    coverage.views[i] = static_cast<std::uint8_t>(std::min(seen, 255));
    coverage.ground_sample_mm[i] = static_cast<float>(finest);
  });
  return coverage;
}

}  // namespace skullstation
