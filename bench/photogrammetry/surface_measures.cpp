#include "bench/photogrammetry/surface_measures.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "core/units.h"
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

/// Angle between the normal and the third best of the views that see the point [deg]; nothing if
/// fewer than three do.
std::optional<double> third_best_slant_deg(const SurfaceSample& sample, const TriangleMesh& truth,
                                           const RayScene& scene,
                                           std::span<const StereoView> views) {
  const Eigen::Vector3d a = truth.vertices.row(truth.triangles(sample.triangle, 0));
  const Eigen::Vector3d b = truth.vertices.row(truth.triangles(sample.triangle, 1));
  const Eigen::Vector3d c = truth.vertices.row(truth.triangles(sample.triangle, 2));
  const Eigen::Vector3d normal = (b - a).cross(c - a).normalized();
  std::vector<double> cosines;
  for (const StereoView& view : views) {
    const Eigen::Vector3d way = view.centre_mm() - sample.point;
    const double distance = way.norm();
    const double cosine = way.dot(normal) / distance;
    if (cosine <= 0.1) continue;
    if (scene.blocked(sample.point + 0.02 * normal, way / distance, distance)) continue;
    cosines.push_back(cosine);
  }
  if (cosines.size() < 3) return std::nullopt;
  std::sort(cosines.begin(), cosines.end(), std::greater<>());
  return degrees(std::acos(std::min(cosines[2], 1.0)));
}

/// By area: what of the truth is seen and what the surface comes near to.
void measure_completeness(const std::vector<SurfaceSample>& samples,
                          const std::vector<std::optional<double>>& slant_deg,
                          const std::vector<double>& gap_mm, SurfaceMeasures& measures) {
  constexpr std::array<double, 5> limits_deg = {45.0, 60.0, 70.0, 78.0, 90.0};
  std::array<double, 5> seen{}, near{};
  double one = 0.0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!slant_deg[i]) continue;
    const auto limit = std::lower_bound(limits_deg.begin(), limits_deg.end(), *slant_deg[i]);
    const auto bin = static_cast<std::size_t>(limit - limits_deg.begin());
    seen[bin] += samples[i].area_mm2;
    if (gap_mm[i] < 0.5) near[bin] += samples[i].area_mm2;
    if (gap_mm[i] < 1.0) one += samples[i].area_mm2;
  }
  double all_seen = 0.0, all_near = 0.0;
  for (std::size_t bin = 0; bin < limits_deg.size(); ++bin) {
    all_seen += seen[bin];
    all_near += near[bin];
    measures.by_slant[bin] = {std::min(limits_deg[bin], 84.0), seen[bin] / 100.0,
                              seen[bin] > 0.0 ? 100.0 * near[bin] / seen[bin] : 0.0};
  }
  measures.seen_cm2 = all_seen / 100.0;
  measures.within_half_mm_percent = 100.0 * all_near / all_seen;
  measures.within_1mm_percent = 100.0 * one / all_seen;
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
  std::vector<std::optional<double>> slant_deg(true_samples->size());
  std::vector<double> gap_mm(true_samples->size());
  for_each_sample(*true_samples, threads, [&](int i) {
    const SurfaceSample& sample = (*true_samples)[i];
    slant_deg[i] = third_best_slant_deg(sample, truth, scene, views);
    if (slant_deg[i]) gap_mm[i] = surface_tree.closest(sample.point, 2.0).distance_mm;
  });
  measure_completeness(*true_samples, slant_deg, gap_mm, measures);
  return measures;
}

Result<CommonMeasures> measure_what_all_hold(std::span<const TriangleMesh> surfaces,
                                             const TriangleMesh& truth, int threads) {
  constexpr double most_mm = 2.0;
  const auto samples = sample_surface(truth, 0.5);
  if (!samples) return forward(samples);
  std::vector<std::vector<double>> gaps_mm;
  std::vector<char> common(samples->size(), 1);
  for (const TriangleMesh& surface : surfaces) {
    const TriangleBvh tree(surface);
    std::vector<double>& gaps = gaps_mm.emplace_back(samples->size());
    for_each_sample(*samples, threads, [&](int i) {
      const ClosestPoint closest = tree.closest((*samples)[i].point, most_mm);
      gaps[i] = closest.triangle < 0 ? most_mm : closest.distance_mm;
      if (gaps[i] >= most_mm) common[i] = 0;
    });
  }
  CommonMeasures measures;
  for (std::size_t i = 0; i < samples->size(); ++i) {
    if (common[i] != 0) measures.area_cm2 += (*samples)[i].area_mm2 / 100.0;
  }
  for (const std::vector<double>& gaps : gaps_mm) {
    std::vector<double> held;
    for (std::size_t i = 0; i < gaps.size(); ++i) {
      if (common[i] != 0) held.push_back(gaps[i]);
    }
    GapMeasures& m = measures.gaps.emplace_back();
    if (held.empty()) continue;
    std::sort(held.begin(), held.end());
    for (const double gap : held) m.mean_mm += gap / static_cast<double>(held.size());
    m.median_mm = held[held.size() / 2];
    m.p95_mm = held[held.size() * 95 / 100];
  }
  return measures;
}

std::array<EstimatedAccuracy, 5> check_estimates(const TriangleMesh& surface,
                                                 std::span<const float> accuracy_mm,
                                                 const TriangleMesh& truth, int threads) {
  struct Vertex {
    double stated_mm = 0.0;
    double off_mm = 0.0;
  };
  std::vector<Vertex> vertices(accuracy_mm.size());
  const TriangleBvh tree(truth);
  const auto count = static_cast<int>(vertices.size());
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    for (int v = batch * kBatch; v < std::min(count, (batch + 1) * kBatch); ++v) {
      vertices[v] = {accuracy_mm[v], tree.closest(surface.vertices.row(v)).distance_mm};
    }
  });
  std::erase_if(vertices, [](const Vertex& vertex) { return vertex.stated_mm <= 0.0; });
  std::ranges::sort(vertices, {}, &Vertex::stated_mm);
  std::array<EstimatedAccuracy, 5> fifths;
  for (std::size_t k = 0; k < fifths.size(); ++k) {
    const std::span<Vertex> fifth =
        std::span(vertices).subspan(k * vertices.size() / 5, vertices.size() / 5);
    if (fifth.empty()) continue;
    const auto within = std::ranges::count_if(
        fifth, [](const Vertex& vertex) { return vertex.off_mm < 2.0 * vertex.stated_mm; });
    fifths[k].estimate_mm = fifth[fifth.size() / 2].stated_mm;
    fifths[k].within_twice_percent =
        100.0 * static_cast<double>(within) / static_cast<double>(fifth.size());
    std::ranges::sort(fifth, {}, &Vertex::off_mm);
    fifths[k].error_mm = 1.4826 * fifth[fifth.size() / 2].off_mm;
  }
  return fifths;
}

}  // namespace skullstation
