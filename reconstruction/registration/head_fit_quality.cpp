#include "reconstruction/registration/head_fit_quality.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/registration/head_sheet.h"
#include "reconstruction/registration/skull_fit_quality.h"

namespace skullstation {

namespace {

/// The paper prunes pairs farther apart before it measures.
constexpr double kKept_mm = 2.0;
constexpr double kKeptAngle_deg = 60.0;
constexpr int kChunk = 256;

}  // namespace

void measure_head_fit(const HeadTemplate& head, const Points3& vertices, const TriangleMesh& scan,
                      const ScanPoints& points, int threads, FittedHead& fitted) {
  const std::vector<bool> rim = boundary_vertices(head.triangles, head.vertices.rows());
  const HeadSheet sheet(head, vertices, rim);
  const auto count = static_cast<int>(points.points.size());
  std::vector<SheetHit> hits(static_cast<std::size_t>(count));
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) {
      hits[static_cast<std::size_t>(i)] = sheet.nearest(points.points.positions.row(i));
    }
  });
  const double least_cosine = std::cos(radians(kKeptAngle_deg));
  std::vector<double> kept;
  std::vector<double> facial;
  double squares = 0.0;
  double weights = 0.0;
  int considered = 0;
  for (int i = 0; i < count; ++i) {
    const SheetHit& hit = hits[static_cast<std::size_t>(i)];
    if (hit.beyond_edge) continue;
    ++considered;
    bool face = true;
    double weight = 0.0;
    for (int k = 0; k < 3; ++k) {
      const auto v = static_cast<std::size_t>(hit.place.corners[k]);
      face = face && is_facial(head.region[v]);
      weight += hit.place.weights[k] * head.data_weight[v];
    }
    if (face) facial.push_back(hit.distance_mm);
    if (hit.distance_mm > kKept_mm ||
        hit.normal.dot(points.points.normals.row(i).transpose()) < least_cosine) {
      continue;
    }
    weight *= points.weight[i];
    kept.push_back(hit.distance_mm);
    squares += weight * hit.distance_mm * hit.distance_mm;
    weights += weight;
  }
  HeadFitQuality& quality = fitted.quality;
  quality.kept_share = considered > 0 ? static_cast<double>(kept.size()) / considered : 0.0;
  quality.weighted_rms_mm = weights > 0.0 ? std::sqrt(squares / weights) : 0.0;
  quality.kept = distances_of(std::move(kept));
  quality.facial = distances_of(std::move(facial));

  const TriangleBvh bvh(scan);
  const TriangleMesh surface = surface_of(head, vertices);
  const auto vertex_count = static_cast<std::size_t>(vertices.rows());
  fitted.distance_mm.resize(vertex_count);
  fitted.observed.resize(vertex_count);
  for (std::size_t v = 0; v < vertex_count; ++v) {
    const auto row = static_cast<Eigen::Index>(v);
    const ClosestPoint closest = bvh.closest(vertices.row(row));
    fitted.distance_mm[v] = closest.distance_mm;
    const auto corner = [&](int i) -> Eigen::Vector3d {
      return scan.vertices.row(scan.triangles(closest.triangle, i));
    };
    const Eigen::Vector3d normal =
        (corner(1) - corner(0)).cross(corner(2) - corner(0)).normalized();
    fitted.observed[v] = closest.distance_mm <= kKept_mm &&
                         normal.dot(surface.normals.row(row).transpose()) >= least_cosine;
  }
}

}  // namespace skullstation
