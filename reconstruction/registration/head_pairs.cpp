#include "reconstruction/registration/head_pairs.h"

#include <algorithm>
#include <cmath>

#include "core/median.h"
#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/registration/head_sheet.h"
#include "reconstruction/registration/oriented_point_tree.h"

namespace skullstation {

namespace {

constexpr double kLeastScale_mm = 0.3;
constexpr int kChunk = 256;

template <class Work>
void for_each_of(int count, int threads, const Work& work) {
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int i = chunk * kChunk; i < std::min(count, (chunk + 1) * kChunk); ++i) work(i);
  });
}

}  // namespace

std::vector<HeadPair> alike_pairs(const HeadTemplate& head, const Points3& vertices,
                                  const std::vector<bool>& rim, const ScanPoints& scan,
                                  const HeadPairLimits& limits, int threads) {
  const TriangleMesh surface = surface_of(head, vertices);
  const OrientedPoints& points = scan.points;
  const double least_cosine = std::cos(radians(limits.normal_deg));
  const auto count = static_cast<int>(points.size());
  std::vector<HeadPair> pairs(static_cast<std::size_t>(count));
  const OrientedPointTree tree({surface.vertices, surface.normals});
  for_each_of(count, threads, [&](int i) {
    const int v = tree.nearest(points.positions.row(i), points.normals.row(i)).index;
    const auto at = static_cast<std::size_t>(v);
    if (rim[at] ||
        (surface.vertices.row(v) - points.positions.row(i)).norm() > limits.distance_mm ||
        surface.normals.row(v).dot(points.normals.row(i)) < least_cosine) {
      return;
    }
    pairs[static_cast<std::size_t>(i)] = {{{v, v, v}, Eigen::Vector3d::UnitX()},
                                          points.positions.row(i),
                                          scan.weight[i] * head.data_weight[at]};
  });
  return pairs;
}

std::vector<HeadPair> nearest_pairs(const HeadTemplate& head, const Points3& vertices,
                                    const std::vector<bool>& rim, const ScanPoints& scan,
                                    const HeadPairLimits& limits, double tangential_share,
                                    int threads) {
  const HeadSheet sheet(head, vertices, rim);
  const double least_cosine = std::cos(radians(limits.normal_deg));
  const auto count = static_cast<int>(scan.points.size());
  std::vector<HeadPair> pairs(static_cast<std::size_t>(count));
  for_each_of(count, threads, [&](int i) {
    const Eigen::Vector3d query = scan.points.positions.row(i);
    const Eigen::Vector3d normal = scan.points.normals.row(i);
    const SheetHit hit = sheet.nearest(query);
    if (hit.distance_mm > limits.distance_mm || hit.beyond_edge ||
        hit.normal.dot(normal) < least_cosine) {
      return;
    }
    double believed = 0.0;
    for (int k = 0; k < 3; ++k) {
      believed +=
          hit.place.weights[k] * head.data_weight[static_cast<std::size_t>(hit.place.corners[k])];
    }
    const Eigen::Vector3d gap = query - hit.point;
    const Eigen::Vector3d across = gap.dot(normal) * normal;
    pairs[static_cast<std::size_t>(i)] = {hit.place,
                                          hit.point + across + tangential_share * (gap - across),
                                          scan.weight[i] * std::clamp(believed, 0.0, 1.0)};
  });
  return pairs;
}

HeadPairDistances weigh(std::vector<HeadPair>& pairs, const Points3& vertices) {
  const auto distance_mm = [&](const HeadPair& pair) {
    return (pair.place.position(vertices) - pair.target).norm();
  };
  std::vector<double> distances;
  double squares = 0.0;
  for (const HeadPair& pair : pairs) {
    if (pair.weight <= 0.0) continue;
    distances.push_back(distance_mm(pair));
    squares += distances.back() * distances.back();
  }
  if (distances.empty()) return {};
  const auto count = static_cast<int>(distances.size());
  const double nu = std::max(4.0 * median(distances), kLeastScale_mm);
  for (HeadPair& pair : pairs) {
    if (pair.weight <= 0.0) continue;
    const double share = distance_mm(pair) / nu;
    pair.weight *= std::exp(-0.5 * share * share);
  }
  return {count, std::sqrt(squares / count)};
}

}  // namespace skullstation
