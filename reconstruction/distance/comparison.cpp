#include "reconstruction/distance/comparison.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "core/parallel.h"
#include "reconstruction/distance/pseudo_normals.h"
#include "reconstruction/distance/surface_samples.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/distance/trimmed_icp.h"

namespace skullstation {

namespace {

constexpr int block = 1024;

struct Target {
  TriangleBvh bvh;
  PseudoNormals normals;

  explicit Target(const TriangleMesh& mesh) : bvh(mesh), normals(mesh) {}
};

/// Calls `work(index)` for all indices, in blocks.
void for_each_index(std::size_t count, int threads, const std::function<void(std::size_t)>& work) {
  const int blocks = static_cast<int>((count + block - 1) / block);
  parallel_for(blocks, threads, [&](int b) {
    const std::size_t begin = static_cast<std::size_t>(b) * block;
    for (std::size_t i = begin; i < std::min(count, begin + block); ++i) work(i);
  });
}

std::vector<double> vertex_distances(const TriangleMesh& mesh, const Target& target, int threads) {
  std::vector<double> distance_mm(static_cast<std::size_t>(mesh.vertices.rows()));
  for_each_index(distance_mm.size(), threads, [&](std::size_t v) {
    const Eigen::Vector3d point = mesh.vertices.row(static_cast<Eigen::Index>(v));
    distance_mm[v] = target.normals.signed_distance_mm(point, target.bvh.closest(point));
  });
  return distance_mm;
}

/// Which triangles have all their corners in the region.
std::vector<bool> triangles_within(const TriangleMesh& mesh, const std::vector<bool>& region) {
  std::vector<bool> counts(static_cast<std::size_t>(mesh.triangles.rows()), true);
  if (region.empty()) return counts;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      if (!region[static_cast<std::size_t>(mesh.triangles(f, corner))]) {
        counts[static_cast<std::size_t>(f)] = false;
      }
    }
  }
  return counts;
}

struct Measured {
  double distance_mm = 0.0;  // signed
  double area_mm2 = 0.0;     // 0: does not count
};

/// Which triangles count: of the surface that is sampled, of the one that is measured to.
struct Region {
  const std::vector<bool>* sampled = nullptr;
  const std::vector<bool>* target = nullptr;
};

Result<std::vector<Measured>> measure(const TriangleMesh& mesh, const Target& target,
                                      const Region& region, const ComparisonOptions& options) {
  const auto samples = sample_surface(mesh, options.samples_per_mm2);
  if (!samples) return forward(samples);
  std::vector<Measured> measured(samples->size());
  for_each_index(samples->size(), options.threads, [&](std::size_t i) {
    const SurfaceSample& sample = (*samples)[i];
    if (region.sampled && !(*region.sampled)[static_cast<std::size_t>(sample.triangle)]) return;
    const ClosestPoint closest = target.bvh.closest(sample.point);
    if (region.target && !(*region.target)[static_cast<std::size_t>(closest.triangle)]) return;
    measured[i] = {target.normals.signed_distance_mm(sample.point, closest), sample.area_mm2};
  });
  std::erase_if(measured, [](const Measured& m) { return m.area_mm2 == 0.0; });
  return measured;
}

DistanceStatistics statistics_of(std::vector<Measured> measured, const ComparisonOptions& options) {
  DistanceStatistics statistics;
  statistics.samples = measured.size();
  const auto bins =
      static_cast<std::size_t>(std::ceil(options.histogram_end_mm / options.histogram_bin_mm));
  statistics.histogram.assign(bins + 1, 0.0);
  double sum = 0.0;
  double sum_squared = 0.0;
  double sum_signed = 0.0;
  for (Measured& m : measured) {
    statistics.area_mm2 += m.area_mm2;
    sum_signed += m.area_mm2 * m.distance_mm;
    m.distance_mm = std::abs(m.distance_mm);
    sum += m.area_mm2 * m.distance_mm;
    sum_squared += m.area_mm2 * m.distance_mm * m.distance_mm;
    const double bin = std::min(m.distance_mm / options.histogram_bin_mm, double(bins));
    statistics.histogram[static_cast<std::size_t>(bin)] += m.area_mm2;
  }
  for (double& share : statistics.histogram) share /= statistics.area_mm2;
  statistics.mean_mm = sum / statistics.area_mm2;
  statistics.rms_mm = std::sqrt(sum_squared / statistics.area_mm2);
  statistics.signed_mean_mm = sum_signed / statistics.area_mm2;

  std::ranges::sort(measured, [](const Measured& left, const Measured& right) {
    return std::pair(left.distance_mm, left.area_mm2) <
           std::pair(right.distance_mm, right.area_mm2);
  });
  const auto quantile = [&](double share) {
    double area_mm2 = 0.0;
    for (const Measured& m : measured) {
      area_mm2 += m.area_mm2;
      if (area_mm2 >= share * statistics.area_mm2) return m.distance_mm;
    }
    return measured.back().distance_mm;
  };
  statistics.median_mm = quantile(0.5);
  statistics.p95_mm = quantile(0.95);
  statistics.max_mm = measured.back().distance_mm;
  return statistics;
}

Result<Similarity3> aligned(const TriangleMesh& a, const TriangleMesh& b,
                            const ComparisonOptions& options, const Progress& progress) {
  if (options.align == Alignment::none) return Similarity3{};
  TrimmedIcpOptions icp;
  icp.estimate_scale = options.align == Alignment::similarity;
  icp.threads = options.threads;
  const auto result = align_by_trimmed_icp(a, b, icp, progress);
  if (!result) return forward(result);
  return result->b_from_a;
}

TriangleMesh moved(TriangleMesh mesh, const Similarity3& b_from_a) {
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d point = mesh.vertices.row(v);
    mesh.vertices.row(v) = b_from_a * point;
  }
  return mesh;
}

}  // namespace

Result<void> ComparisonOptions::validate() const {
  const auto bad = [](const char* what) { return fail(ErrorKind::usage, "compare", what); };
  if (!(samples_per_mm2 > 0.0)) return bad("samples_per_mm2 must be positive");
  if (!(histogram_bin_mm > 0.0)) return bad("histogram_bin_mm must be positive");
  if (!(histogram_end_mm >= histogram_bin_mm)) return bad("histogram_end_mm must hold one bin");
  if (histogram_end_mm / histogram_bin_mm > 1e6) return bad("the histogram has too many bins");
  return {};
}

Result<Comparison> compare_surfaces(const TriangleMesh& a, const TriangleMesh& b,
                                    const ComparisonOptions& options, const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (!(surface_area(a) > 0.0)) return fail(ErrorKind::bad_input, "mesh A", "has no surface");
  if (!(surface_area(b) > 0.0)) return fail(ErrorKind::bad_input, "mesh B", "has no surface");
  if (!options.region.empty() && std::ssize(options.region) != a.vertices.rows()) {
    return fail(ErrorKind::bad_input, "region",
                fmt::format("tells of {} vertices, mesh A has {}", options.region.size(),
                            a.vertices.rows()));
  }
  Comparison comparison;
  const auto b_from_a = aligned(a, b, options, progress.part(0.0, 0.3));
  if (!b_from_a) return forward(b_from_a);
  comparison.b_from_a = *b_from_a;
  const TriangleMesh moved_a = options.align == Alignment::none ? a : moved(a, *b_from_a);

  const Target target_a(moved_a);
  const Target target_b(b);
  const std::vector<bool> counts = triangles_within(a, options.region);
  const auto cancelled = [&] { return progress.stop.stop_requested(); };
  const auto stopped = [] { return fail(ErrorKind::cancelled, "compare", "was cancelled"); };

  progress.report(0.3, "measuring A to B");
  auto a_to_b = measure(moved_a, target_b, {&counts, nullptr}, options);
  if (!a_to_b) return forward(a_to_b);
  if (cancelled()) return stopped();
  if (a_to_b->empty()) return fail(ErrorKind::bad_input, "region", "covers no triangle of mesh A");
  progress.report(0.6, "measuring B to A");
  auto b_to_a = measure(b, target_a, {nullptr, &counts}, options);
  if (!b_to_a) return forward(b_to_a);
  if (cancelled()) return stopped();
  if (b_to_a->empty()) return fail(ErrorKind::bad_input, "region", "no part of mesh B is near it");
  comparison.a_to_b = statistics_of(std::move(*a_to_b), options);
  comparison.b_to_a = statistics_of(std::move(*b_to_a), options);

  progress.report(0.9, "measuring the vertices");
  comparison.vertex_distance_a_mm = vertex_distances(moved_a, target_b, options.threads);
  comparison.vertex_distance_b_mm = vertex_distances(b, target_a, options.threads);
  for (std::size_t f = 0; f < counts.size(); ++f) {
    if (!counts[f]) continue;
    for (const int v : a.triangles.row(static_cast<Eigen::Index>(f))) {
      const double distance_mm =
          std::abs(comparison.vertex_distance_a_mm[static_cast<std::size_t>(v)]);
      comparison.a_to_b.max_mm = std::max(comparison.a_to_b.max_mm, distance_mm);
    }
  }
  if (options.region.empty()) {
    for (const double distance_mm : comparison.vertex_distance_b_mm) {
      comparison.b_to_a.max_mm = std::max(comparison.b_to_a.max_mm, std::abs(distance_mm));
    }
  }
  comparison.hausdorff_mm = std::max(comparison.a_to_b.max_mm, comparison.b_to_a.max_mm);
  return comparison;
}

TriangleMesh colored_by_distance(TriangleMesh mesh, const std::vector<double>& distance_mm,
                                 double full_color_mm, const std::vector<bool>& region) {
  const Eigen::RowVector3d blue(33, 102, 172);
  const Eigen::RowVector3d white(247, 247, 247);
  const Eigen::RowVector3d red(178, 24, 43);
  const Eigen::RowVector3d grey(128, 128, 128);
  mesh.colors.resize(mesh.vertices.rows(), 3);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const auto index = static_cast<std::size_t>(v);
    const double t = std::clamp(distance_mm[index] / full_color_mm, -1.0, 1.0);
    Eigen::RowVector3d color = white + std::abs(t) * ((t < 0.0 ? blue : red) - white);
    if (!region.empty() && !region[index]) color = grey;
    mesh.colors.row(v) = color.array().round().matrix().cast<std::uint8_t>();
  }
  return mesh;
}

}  // namespace skullstation
