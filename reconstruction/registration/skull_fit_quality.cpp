#include "reconstruction/registration/skull_fit_quality.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/registration/observed_bone.h"
#include "reconstruction/rendering/outside.h"

namespace skullstation {

namespace {
constexpr double kObserved_mm = 2.0;
constexpr double kObservedAngle_deg = 60.0;
/// On the undeformed template: farther apart are different places.
constexpr double kSamePlace_mm = 12.0;
/// Of the input's vertices; more tell no more.
constexpr int kMeasured = 60000;
/// Rays over the whole sphere to learn whether a vertex of the input lies on its outside.
constexpr int kDirections = 100;
constexpr int kChunk = 512;
/// Share of the mandible that has to be observed for there to be one.
constexpr double kLeastMandible = 0.2;

}  // namespace

FitDistances distances_of(std::vector<double> distances_mm) {
  FitDistances result;
  result.points = static_cast<int>(distances_mm.size());
  if (distances_mm.empty()) return result;
  double squares = 0.0;
  for (const double d : distances_mm) {
    result.mean_mm += d;
    squares += d * d;
    result.max_mm = std::max(result.max_mm, d);
  }
  const auto count = static_cast<double>(distances_mm.size());
  result.mean_mm /= count;
  result.rms_mm = std::sqrt(squares / count);
  const auto rank = distances_mm.begin() + static_cast<std::ptrdiff_t>(
                                               0.95 * static_cast<double>(distances_mm.size() - 1));
  std::nth_element(distances_mm.begin(), rank, distances_mm.end());
  result.p95_mm = *rank;
  return result;
}

void measure_skull_fit(const SkullTemplate& skull, const Points3& vertices,
                       const InputSurface& input, int threads, FittedSkull& fitted) {
  const TriangleMesh surface = surface_of(skull, vertices);
  const TriangleBvh bvh(surface);
  // A place of the input is one place of the template: what lies on it by chance, a bone that is
  // missing say, isn't observed.
  const auto shows = [&](const InputHit& hit, int v) {
    const Eigen::Vector3i corners = skull.boundary.row(bvh.closest(hit.point).triangle);
    const auto bone_at = [&](int w) { return bone_of(skull.region[static_cast<std::size_t>(w)]); };
    return bone_at(corners[0]) == bone_at(v) &&
           (skull.vertices.row(corners[0]) - skull.vertices.row(v)).norm() <= kSamePlace_mm;
  };
  const auto count = static_cast<std::size_t>(skull.boundary_count);
  std::vector<char> observed(count, 0);
  fitted.distance_mm.assign(count, 0.0);
  parallel_for((skull.boundary_count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int v = chunk * kChunk; v < std::min(skull.boundary_count, (chunk + 1) * kChunk); ++v) {
      const auto at = static_cast<std::size_t>(v);
      const InputHit any =
          input.nearest_point(surface.vertices.row(v), surface.normals.row(v), 1e3, 180.0);
      fitted.distance_mm[at] = any.valid ? any.distance_mm : 1e3;
      if (!skull.outer[at] || fitted.distance_mm[at] > kObserved_mm) continue;
      const InputHit hit = input.nearest_point(surface.vertices.row(v), surface.normals.row(v),
                                               kObserved_mm, kObservedAngle_deg);
      observed[at] = hit.valid && shows(hit, v);
    }
  });
  // Islands of a missing bone that came to lie on another are no bone.
  fitted.observed.assign(observed.begin(), observed.end());
  const Eigen::VectorXd around = observed_around(skull, fitted.observed);
  for (std::size_t v = 0; v < count; ++v) {
    if (around[static_cast<Eigen::Index>(v)] < 0.5) fitted.observed[v] = false;
  }
  SkullFitQuality& quality = fitted.quality;
  quality.mandible_observed_share = observed_share(skull, fitted.observed, SkullBone::mandible);
  if (quality.mandible_observed_share < kLeastMandible) {
    quality.mandible_observed_share = 0.0;
    for (std::size_t v = 0; v < count; ++v) {
      if (bone_of(skull.region[v]) == SkullBone::mandible) fitted.observed[v] = false;
    }
  }
  quality.observed_share = observed_share(skull, fitted.observed);

  const auto points = static_cast<int>(input.mesh().vertices.rows());
  const int stride = std::max(1, points / kMeasured);
  const int measured = (points + stride - 1) / stride;
  std::vector<int> own(static_cast<std::size_t>(measured));
  for (int i = 0; i < measured; ++i) own[static_cast<std::size_t>(i)] = i * stride;
  const std::vector<bool> on_outside = outside_vertices(input.mesh(), own, kDirections, threads);
  std::vector<ClosestPoint> hits(static_cast<std::size_t>(measured));
  parallel_for((measured + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(measured, (chunk + 1) * kChunk); ++i) {
      hits[static_cast<std::size_t>(i)] =
          bvh.closest(input.mesh().vertices.row(own[static_cast<std::size_t>(i)]));
    }
  });
  std::vector<double> facial;
  std::vector<double> facial_bone;
  std::vector<double> all;
  for (std::size_t i = 0; i < hits.size(); ++i) {
    const ClosestPoint& hit = hits[i];
    bool outside = on_outside[i];
    bool face = true;
    bool tooth = false;
    for (int c = 0; c < 3; ++c) {
      const auto v = static_cast<std::size_t>(skull.boundary(hit.triangle, c));
      outside = outside && skull.outer[v];
      face = face && is_facial(skull.region[v]);
      tooth = tooth || is_tooth(skull.region[v]);
    }
    if (!outside) continue;
    all.push_back(hit.distance_mm);
    if (face) facial.push_back(hit.distance_mm);
    if (face && !tooth) facial_bone.push_back(hit.distance_mm);
  }
  quality.facial = distances_of(std::move(facial));
  quality.facial_bone = distances_of(std::move(facial_bone));
  quality.outer = distances_of(std::move(all));

  const Eigen::ArrayXd shares = signed_volumes(skull.tetrahedra, vertices).array() /
                                signed_volumes(skull.tetrahedra, skull.vertices).array();
  quality.inverted_tetrahedra = static_cast<int>((shares <= 0.0).count());
  quality.least_scaled_volume = shares.minCoeff();
}

}  // namespace skullstation
