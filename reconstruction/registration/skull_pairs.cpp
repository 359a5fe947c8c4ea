#include "reconstruction/registration/skull_pairs.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/registration/oriented_point_tree.h"

namespace skullstation {

namespace {

constexpr double kToothWeight = 0.3;
constexpr int kChunk = 512;

template <class Work>
void for_each_vertex(int count, int threads, const Work& work) {
  parallel_for((count + kChunk - 1) / kChunk, threads, [&](int chunk) {
    for (int v = chunk * kChunk; v < std::min(count, (chunk + 1) * kChunk); ++v) work(v);
  });
}

/// Pairs farther apart than most count less (Welsch, scale from the median).
void weigh(SkullPairs& pairs, const SkullState& state, double least_scale_mm) {
  std::vector<double> distances;
  for (int v = 0; v < state.skull->boundary_count; ++v) {
    if (pairs.weight[v] > 0.0) {
      distances.push_back((pairs.target.row(v) - state.surface.vertices.row(v)).norm());
    }
  }
  pairs.count = static_cast<int>(distances.size());
  if (distances.empty()) return;
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  const double nu = std::max(3.0 * *middle, least_scale_mm);
  double squares = 0.0;
  for (int v = 0; v < state.skull->boundary_count; ++v) {
    if (pairs.weight[v] <= 0.0) continue;
    const double squared = (pairs.target.row(v) - state.surface.vertices.row(v)).squaredNorm();
    squares += squared;
    pairs.weight[v] *= std::exp(-0.5 * squared / (nu * nu));
    if (is_tooth(state.skull->region[static_cast<std::size_t>(v)])) pairs.weight[v] *= kToothWeight;
  }
  pairs.rms_mm = std::sqrt(squares / pairs.count);
}

SkullPairs no_pairs(int count) {
  return {Eigen::VectorXd::Zero(count),
          Points3::Zero(count, 3),
          Points3::Zero(count, 3),
          std::vector<bool>(static_cast<std::size_t>(count), false),
          0,
          0.0};
}

void take(SkullPairs& pairs, int v, const InputHit& hit, double weight) {
  if (!hit.valid) return;
  pairs.weight[v] = weight;
  pairs.target.row(v) = hit.point.transpose();
  pairs.normal.row(v) = hit.normal.transpose();
}

}  // namespace

void put_over(SkullPairs& pairs, const SkullPairs& more) {
  for (Eigen::Index v = 0; v < more.weight.size(); ++v) {
    if (more.weight[v] <= 0.0) continue;
    pairs.count += pairs.weight[v] > 0.0 ? 0 : 1;
    pairs.weight[v] = more.weight[v];
    pairs.target.row(v) = more.target.row(v);
    pairs.normal.row(v) = more.normal.row(v);
    pairs.anchored[static_cast<std::size_t>(v)] = more.anchored[static_cast<std::size_t>(v)];
  }
}

SkullState state_of(const SkullTemplate& skull, Points3 vertices) {
  SkullState state{&skull, std::move(vertices), {}};
  state.surface = surface_of(skull, state.vertices);
  return state;
}

SkullPairs part_pairs(const SkullState& rest, const PartAlignment& parts, const InputSurface& input,
                      const PairLimits& limits, int threads) {
  const SkullTemplate& skull = *rest.skull;
  SkullPairs pairs = no_pairs(skull.boundary_count);
  SkullState moved = rest;
  for_each_vertex(skull.boundary_count, threads, [&](int v) {
    const auto at = static_cast<std::size_t>(v);
    if (!skull.outer[at]) return;
    const Similarity3& part = parts.regions[static_cast<std::size_t>(skull.region[at])];
    const Eigen::Vector3d position = part * rest.surface.vertices.row(v).transpose();
    moved.surface.vertices.row(v) = position.transpose();
    take(pairs, v,
         input.nearest_sample(position, part.rotation * rest.surface.normals.row(v).transpose(),
                              limits.distance_mm, limits.normal_deg),
         1.0);
  });
  weigh(pairs, moved, limits.least_scale_mm);
  pairs.anchored.assign(pairs.anchored.size(), true);
  return pairs;
}

SkullPairs alike_pairs(const SkullState& state, const InputSurface& input, const PairLimits& limits,
                       bool both_ways, int threads) {
  const SkullTemplate& skull = *state.skull;
  const OrientedPoints& samples = input.samples();
  const double least_cosine = std::cos(radians(limits.normal_deg));
  const auto alike = [&](int v, int sample) {
    return (state.surface.vertices.row(v) - samples.positions.row(sample)).norm() <=
               limits.distance_mm &&
           state.surface.normals.row(v).dot(samples.normals.row(sample)) >= least_cosine;
  };
  const OrientedPointTree own({state.surface.vertices, state.surface.normals});
  std::vector<int> chosen(static_cast<std::size_t>(samples.size()), -1);
  for_each_vertex(static_cast<int>(samples.size()), threads, [&](int i) {
    const int v = own.nearest(samples.positions.row(i), samples.normals.row(i)).index;
    if (alike(v, i)) chosen[static_cast<std::size_t>(i)] = v;
  });
  SkullPairs pairs = no_pairs(skull.boundary_count);
  for (int i = 0; i < static_cast<int>(samples.size()); ++i) {
    const int v = chosen[static_cast<std::size_t>(i)];
    if (v < 0 || !skull.outer[static_cast<std::size_t>(v)]) continue;
    pairs.weight[v] += 1.0;
    pairs.target.row(v) += samples.positions.row(i);
    pairs.normal.row(v) += samples.normals.row(i);
  }
  std::vector<int> alone;
  for (int v = 0; v < skull.boundary_count; ++v) {
    if (pairs.weight[v] > 0.0) {
      pairs.target.row(v) /= pairs.weight[v];
      pairs.normal.row(v).normalize();
      pairs.weight[v] = 1.0;
    } else if (skull.outer[static_cast<std::size_t>(v)]) {
      alone.push_back(v);
    }
  }
  if (both_ways) {
    const OrientedPointTree theirs(samples);
    for_each_vertex(static_cast<int>(alone.size()), threads, [&](int k) {
      const int v = alone[static_cast<std::size_t>(k)];
      const Eigen::Vector3d position = state.surface.vertices.row(v);
      const int i = theirs.nearest(position, state.surface.normals.row(v)).index;
      if (!alike(v, i)) return;
      pairs.weight[v] = 1.0;
      pairs.target.row(v) = samples.positions.row(i);
      pairs.normal.row(v) = samples.normals.row(i);
    });
  }
  weigh(pairs, state, limits.least_scale_mm);
  return pairs;
}

SkullPairs ridge_pairs(const SkullState& state, const std::vector<bool>& ridge,
                       const InputSurface& input, const PairLimits& limits, int threads) {
  const SkullTemplate& skull = *state.skull;
  SkullPairs pairs = no_pairs(skull.boundary_count);
  for_each_vertex(skull.boundary_count, threads, [&](int v) {
    const auto at = static_cast<std::size_t>(v);
    if (!skull.outer[at] || !ridge[at]) return;
    take(pairs, v,
         input.nearest_ridge(state.surface.vertices.row(v), state.surface.normals.row(v),
                             limits.distance_mm, limits.normal_deg),
         1.0);
  });
  weigh(pairs, state, limits.least_scale_mm);
  pairs.anchored.assign(pairs.anchored.size(), true);
  return pairs;
}

SkullPairs two_way_pairs(const SkullState& state, const InputSurface& input,
                         const PairLimits& limits, double inner_weight, int threads) {
  const SkullTemplate& skull = *state.skull;
  // Inner vertices are in the tree, too: what they attract must not go to the outside.
  const PointTree tree(state.surface.vertices);
  const OrientedPoints& samples = input.samples();
  std::vector<int> nearest(static_cast<std::size_t>(samples.size()), -1);
  const double least_cosine = std::cos(radians(limits.normal_deg));
  for_each_vertex(static_cast<int>(samples.size()), threads, [&](int i) {
    const NearPoint near = tree.nearest(samples.positions.row(i), limits.distance_mm);
    if (near.index < 0) return;
    if (state.surface.normals.row(near.index).dot(samples.normals.row(i)) < least_cosine) return;
    nearest[static_cast<std::size_t>(i)] = near.index;
  });
  std::vector<char> found(static_cast<std::size_t>(skull.boundary_count), 0);
  for (const int v : nearest) {
    if (v >= 0) found[static_cast<std::size_t>(v)] = 1;
  }
  SkullPairs pairs = no_pairs(skull.boundary_count);
  for_each_vertex(skull.boundary_count, threads, [&](int v) {
    const auto at = static_cast<std::size_t>(v);
    const double weight = skull.outer[at] ? 1.0 : inner_weight;
    if (found[at] == 0 || weight <= 0.0) return;
    take(pairs, v,
         input.nearest_point(state.surface.vertices.row(v), state.surface.normals.row(v),
                             2.0 * limits.distance_mm, limits.normal_deg),
         weight);
  });
  weigh(pairs, state, limits.least_scale_mm);
  return pairs;
}

}  // namespace skullstation
