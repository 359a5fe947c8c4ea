#include "bench/photogrammetry/surface_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/distance/surface_samples.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/rendering/ray_scene.h"

namespace skullstation {

namespace {

constexpr int kBatch = 1000;

template <class Work>
void for_each_sample(const std::vector<SurfaceSample>& samples, int threads, const Work& work) {
  const auto count = static_cast<int>(samples.size());
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    for (int i = batch * kBatch; i < std::min(count, (batch + 1) * kBatch); ++i) work(i);
  });
}

int views_that_see(const SurfaceSample& sample, const TriangleMesh& truth, const RayScene& scene,
                   std::span<const StereoView> views) {
  const Eigen::Vector3d a = truth.vertices.row(truth.triangles(sample.triangle, 0));
  const Eigen::Vector3d b = truth.vertices.row(truth.triangles(sample.triangle, 1));
  const Eigen::Vector3d c = truth.vertices.row(truth.triangles(sample.triangle, 2));
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  int seen = 0;
  for (const StereoView& view : views) {
    const Eigen::Vector3d way = view.centre_mm() - sample.point;
    const double distance = way.norm();
    if (way.dot(normal) <= 0.1 * distance) continue;
    seen += scene.blocked(sample.point + 0.02 * normal, way / distance, distance) ? 0 : 1;
  }
  return seen;
}

}  // namespace

Result<SurfaceMeasures> measure_surface(const TriangleMesh& surface, const TriangleMesh& truth,
                                        std::span<const StereoView> views, int threads) {
  const auto samples = sample_surface(surface, 1.0);
  const auto true_samples = sample_surface(truth, 0.5);
  if (!samples) return forward(samples);
  if (!true_samples) return forward(true_samples);

  const TriangleBvh truth_tree(truth);
  std::vector<std::pair<double, double>> distances(samples->size());  // and area
  for_each_sample(*samples, threads, [&](int i) {
    const SurfaceSample& sample = (*samples)[i];
    distances[i] = {truth_tree.closest(sample.point).distance_mm, sample.area_mm2};
  });
  std::sort(distances.begin(), distances.end());
  SurfaceMeasures measures;
  double total = 0.0, sum = 0.0, above = 0.0;
  for (const auto& [distance, area] : distances) {
    total += area;
    sum += area * distance;
    if (distance > 1.0) above += area;
  }
  double passed = 0.0;
  for (const auto& [distance, area] : distances) {
    passed += area;
    if (passed <= 0.5 * total) measures.median_mm = distance;
    if (passed <= 0.95 * total) measures.p95_mm = distance;
  }
  measures.area_cm2 = total / 100.0;
  measures.mean_mm = sum / total;
  measures.above_1mm_percent = 100.0 * above / total;

  const TriangleBvh surface_tree(surface);
  const TriangleMesh* const meshes[] = {&truth};
  const RayScene scene(meshes);
  std::vector<double> gap(true_samples->size(), -1.0);
  for_each_sample(*true_samples, threads, [&](int i) {
    const SurfaceSample& sample = (*true_samples)[i];
    if (views_that_see(sample, truth, scene, views) < 3) return;
    gap[i] = surface_tree.closest(sample.point, 2.0).distance_mm;
  });
  double seen = 0.0, half = 0.0, one = 0.0;
  for (std::size_t i = 0; i < gap.size(); ++i) {
    if (gap[i] < 0.0) continue;
    const double area = (*true_samples)[i].area_mm2;
    seen += area;
    if (gap[i] < 0.5) half += area;
    if (gap[i] < 1.0) one += area;
  }
  measures.seen_cm2 = seen / 100.0;
  measures.within_half_mm_percent = 100.0 * half / seen;
  measures.within_1mm_percent = 100.0 * one / seen;
  return measures;
}

}  // namespace skullstation
