#include "reconstruction/photogrammetry/patch_match.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"

namespace skullstation {

namespace {

constexpr float kCostUnit = 100.0f;
/// Beyond this a view does not see the surface; how much worse it is says nothing.
constexpr float kCappedCost = 1.0f;

/// A pixel's own stream of uniform numbers in [-1, 1).
class PixelRandom {
 public:
  PixelRandom(std::uint64_t seed, int pass, std::size_t pixel)
      : seed_(mix(seed, (static_cast<std::uint64_t>(pass) << 40) + pixel)) {}
  float symmetric() {
    const std::uint64_t bits = mix(seed_, count_++);
    return static_cast<float>(static_cast<double>(bits >> 40) * 0x1.0p-23 - 1.0);
  }
  float uniform() { return 0.5f * (symmetric() + 1.0f); }

 private:
  std::uint64_t seed_;
  std::uint64_t count_ = 0;
};

/// Where another pixel's plane may come from, relative to the pixel, on the other colour.
struct Step {
  int x, y;
};
constexpr int kSteps = 6;
constexpr Step kSides[4][kSteps] = {
    {{0, -1}, {-1, -2}, {1, -2}, {0, -3}, {0, -5}, {0, -9}},
    {{0, 1}, {-1, 2}, {1, 2}, {0, 3}, {0, 5}, {0, 9}},
    {{-1, 0}, {-2, -1}, {-2, 1}, {-3, 0}, {-5, 0}, {-9, 0}},
    {{1, 0}, {2, -1}, {2, 1}, {3, 0}, {5, 0}, {9, 0}},
};

class Sweeper {
 public:
  Sweeper(const MatchProblem& problem, const SweepOptions& options, int pass,
          std::span<const PlaneMap* const> source_maps, PlaneMap& map)
      : reference_(*problem.reference),
        problem_(problem),
        options_(options),
        pass_(pass),
        source_maps_(source_maps),
        map_(map),
        maker_(options.patch),
        source_count_(static_cast<int>(problem.sources.size())) {
    float inverse_depth_per_px = 0.0f;
    for (int i = 0; i < source_count_; ++i) {
      const StereoLevel& source = *problem.sources[i];
      images_[i] = &source.quads;
      warps_[i] = pixel_warp(reference_.camera, reference_.camera_from_table, source.camera,
                             source.camera_from_table);
      back_[i] = pixel_warp(source.camera, source.camera_from_table, reference_.camera,
                            reference_.camera_from_table);
      const Rigid3 between = source.camera_from_table * reference_.camera_from_table.inverse();
      inverse_depth_per_px +=
          static_cast<float>(1.0 / (source.camera.fx * std::max(between.translation.norm(), 1e-6)));
    }
    px_ = inverse_depth_per_px / static_cast<float>(std::max(source_count_, 1));
    slope_to_gradient_x_ = static_cast<float>(-1.0 / reference_.camera.fx);
    slope_to_gradient_y_ = static_cast<float>(-1.0 / reference_.camera.fy);
  }

  bool is_specimen(int x, int y) const { return reference_.mask.at(x, y) >= 128; }

  /// Draws a plane from the hull's range; w = 0 where the ray misses the hull.
  InversePlane random_plane(int x, int y, PixelRandom& random) const {
    float nearest = 0.0f, farthest = 0.0f;
    range_at(x, y, nearest, farthest);
    InversePlane plane;
    plane.w = farthest + (nearest - farthest) * random.uniform();
    // Slopes of planes evenly distributed over the directions within 60 deg of the line of sight.
    const float cosine = 0.5f + 0.5f * random.uniform();
    const float slope = std::sqrt(1.0f - cosine * cosine) / cosine;
    const float angle = 3.14159265f * random.symmetric();
    plane.gx = slope * std::cos(angle) * plane.w * slope_to_gradient_x_;
    plane.gy = slope * std::sin(angle) * plane.w * slope_to_gradient_y_;
    return plane;
  }

  void score_from_scratch(int x, int y) {
    const std::size_t i = map_.index(x, y);
    Patch patch;
    maker_.make(reference_.grey, reference_.mask, x, y, patch);
    std::array<float, kMostSources> costs{};
    score_plane(patch, maker_.noise_variance(), center(x), center(y), map_.planes[i],
                images_.data(), warps_.data(), kAll.data(), source_count_, costs.data());
    store(i, costs);
    std::fill(costs.begin() + source_count_, costs.end(), kWorstCost);
    std::sort(costs.begin(), costs.end());
    const int counted = std::min(options_.counted_views, source_count_);
    float sum = 0.0f;
    for (int k = 0; k < counted; ++k) sum += std::min(costs[k], kCappedCost);
    map_.cost[i] = sum / static_cast<float>(counted);
  }

  void run() {
    for (int color = 0; color < 2; ++color) {
      for (int y = 0; y < map_.height; ++y) {
        for (int x = (y + color) % 2; x < map_.width; x += 2) {
          if (map_.planes[map_.index(x, y)].w > 0.0f) improve(x, y);
        }
      }
    }
  }

 private:
  static constexpr std::array<std::uint8_t, kMostSources> kAll = {0, 1, 2, 3, 4, 5, 6, 7};
  static float center(int pixel) { return static_cast<float>(pixel) + 0.5f; }

  void range_at(int x, int y, float& nearest, float& farthest) const {
    const HullRange& range = *problem_.range;
    const int u = std::min(x >> problem_.range_level, range.width - 1);
    const int v = std::min(y >> problem_.range_level, range.height - 1);
    const std::size_t i = static_cast<std::size_t>(v) * range.width + u;
    nearest = range.nearest[i];
    farthest = range.farthest[i];
  }

  void store(std::size_t i, const std::array<float, kMostSources>& costs) {
    for (int k = 0; k < source_count_; ++k) {
      map_.source_cost[i][k] =
          static_cast<std::uint8_t>(std::clamp(costs[k] * kCostUnit + 0.5f, 0.0f, 255.0f));
    }
  }

  /// Inside the hull and not seen edge-on (beyond 82 deg).
  bool is_possible(const InversePlane& plane, int x, int y, float nearest, float farthest) const {
    if (!(plane.w >= farthest && plane.w <= nearest)) return false;
    const Pinhole& c = reference_.camera;
    const auto dx = static_cast<float>(center(x) - c.cx);
    const auto dy = static_cast<float>(center(y) - c.cy);
    const auto fx = static_cast<float>(c.fx);
    const auto fy = static_cast<float>(c.fy);
    const float nx = fx * plane.gx;
    const float ny = fy * plane.gy;
    const float nz = plane.w - plane.gx * dx - plane.gy * dy;
    const float ray2 = 1.0f + dx * dx / (fx * fx) + dy * dy / (fy * fy);
    return plane.w * plane.w > 0.14f * 0.14f * (nx * nx + ny * ny + nz * nz) * ray2;
  }

  /// The sources with the least cost here and at the four neighbours.
  int choose_sources(int x, int y, std::array<std::uint8_t, kMostSources>& named) const {
    std::array<int, kMostSources> sum{};
    const std::size_t i = map_.index(x, y);
    for (int k = 0; k < source_count_; ++k) sum[k] = map_.source_cost[i][k];
    constexpr Step around[] = {{0, -1}, {0, 1}, {-1, 0}, {1, 0}};
    for (const Step& step : around) {
      const int u = x + step.x;
      const int v = y + step.y;
      if (u < 0 || v < 0 || u >= map_.width || v >= map_.height) continue;
      const std::size_t j = map_.index(u, v);
      if (map_.planes[j].w == 0.0f) continue;
      for (int k = 0; k < source_count_; ++k) sum[k] += map_.source_cost[j][k];
    }
    named = kAll;
    const int counted = std::min(options_.counted_views, source_count_);
    std::partial_sort(
        named.begin(), named.begin() + counted, named.begin() + source_count_,
        [&](std::uint8_t a, std::uint8_t b) { return sum[a] != sum[b] ? sum[a] < sum[b] : a < b; });
    return counted;
  }

  /// Distance [px] between the pixel and where it comes back to by way of a source's own depth.
  float forward_backward_px(float x, float y, float w, int source) const {
    const auto most = static_cast<float>(options_.most_geometric_px);
    const PixelWarp& to = warps_[source];
    const float z = to.a[6] * x + to.a[7] * y + to.a[8] + to.b[2] * w;
    const float u = (to.a[0] * x + to.a[1] * y + to.a[2] + to.b[0] * w) / z;
    const float v = (to.a[3] * x + to.a[4] * y + to.a[5] + to.b[1] * w) / z;
    const PlaneMap& other = *source_maps_[source];
    if (!(z > 0.0f && u >= 0.0f && v >= 0.0f && u < static_cast<float>(other.width) &&
          v < static_cast<float>(other.height))) {
      return most;
    }
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    const InversePlane& plane = other.planes[other.index(column, row)];
    if (plane.w == 0.0f) return most;
    const float there = plane.at(u - center(column), v - center(row));
    const PixelWarp& from = back_[source];
    const float back_z = from.a[6] * u + from.a[7] * v + from.a[8] + from.b[2] * there;
    const float back_x = (from.a[0] * u + from.a[1] * v + from.a[2] + from.b[0] * there) / back_z;
    const float back_y = (from.a[3] * u + from.a[4] * v + from.a[5] + from.b[1] * there) / back_z;
    const float error = std::sqrt((back_x - x) * (back_x - x) + (back_y - y) * (back_y - y));
    return error < most ? error : most;  // a NaN is no agreement
  }

  struct Pixel {
    int x = 0, y = 0;
    Patch patch;
    std::array<std::uint8_t, kMostSources> named{};
    int counted = 0;
  };

  /// Sum of capped cost over the named sources [begin, end).
  float partial_cost(const Pixel& pixel, const InversePlane& plane, int begin, int end,
                     std::array<float, kMostSources>& costs) const {
    score_plane(pixel.patch, maker_.noise_variance(), center(pixel.x), center(pixel.y), plane,
                images_.data(), warps_.data(), pixel.named.data() + begin, end - begin,
                costs.data() + begin);
    float sum = 0.0f;
    for (int k = begin; k < end; ++k) {
      sum += std::min(costs[k], kCappedCost);
      if (options_.geometric_weight > 0.0) {
        sum += static_cast<float>(options_.geometric_weight) *
               forward_backward_px(center(pixel.x), center(pixel.y), plane.w, pixel.named[k]);
      }
    }
    return sum;
  }

  /// Mean cost over the counted sources, or something above `bound` if it is above.
  float cost_of(const Pixel& pixel, const InversePlane& plane, float bound,
                std::array<float, kMostSources>& costs) const {
    const auto counted = static_cast<float>(pixel.counted);
    const int first = std::min(2, pixel.counted);
    float sum = partial_cost(pixel, plane, 0, first, costs);
    if (sum > bound * counted) return kWorstCost + 1.0f;
    sum += partial_cost(pixel, plane, first, pixel.counted, costs);
    return sum / counted;
  }

  void improve(int x, int y) {
    const std::size_t i = map_.index(x, y);
    Pixel pixel{x, y, {}, {}, 0};
    maker_.make(reference_.grey, reference_.mask, x, y, pixel.patch);
    pixel.counted = choose_sources(x, y, pixel.named);
    float nearest = 0.0f, farthest = 0.0f;
    range_at(x, y, nearest, farthest);

    InversePlane best = map_.planes[i];
    std::array<float, kMostSources> best_costs{};
    float best_cost = cost_of(pixel, best, 10.0f, best_costs);
    const auto try_plane = [&](const InversePlane& plane) {
      if (!is_possible(plane, x, y, nearest, farthest)) return;
      std::array<float, kMostSources> costs{};
      const float cost = cost_of(pixel, plane, best_cost, costs);
      if (cost >= best_cost) return;
      best = plane;
      best_cost = cost;
      best_costs = costs;
    };
    for (const auto& side : kSides) try_neighbour(x, y, side, try_plane);

    PixelRandom random(problem_.seed, pass_, i);
    for (int trial = 0; trial < options_.random_trials; ++trial) {
      try_plane(random_plane(x, y, random));
    }
    float reach = 1.0f;
    for (int trial = 0; trial < options_.refinements; ++trial) {
      InversePlane plane = best;
      const auto depth = static_cast<float>(options_.depth_step_px) * px_ * reach;
      const auto slope = static_cast<float>(options_.slope_step) * reach;
      if (trial % 3 != 1) plane.w += depth * random.symmetric();
      if (trial % 3 != 0) {
        plane.gx += slope * random.symmetric() * plane.w * slope_to_gradient_x_;
        plane.gy += slope * random.symmetric() * plane.w * slope_to_gradient_y_;
      }
      try_plane(plane);
      if (trial % 3 == 2) reach *= 0.5f;
    }
    if (options_.parabola_px > 0.0) descend(pixel, best, best_cost);
    map_.planes[i] = best;
    map_.cost[i] = best_cost;
    remember(pixel, best, best_costs);
  }

  template <class Try>
  void try_neighbour(int x, int y, const Step (&side)[kSteps], const Try& try_plane) const {
    std::size_t from = 0;
    const Step* best = nullptr;
    for (const Step& step : side) {
      const int u = x + step.x;
      const int v = y + step.y;
      if (u < 0 || v < 0 || u >= map_.width || v >= map_.height) continue;
      const std::size_t j = map_.index(u, v);
      if (map_.planes[j].w == 0.0f) continue;
      if (best != nullptr && map_.cost[j] >= map_.cost[from]) continue;
      best = &step;
      from = j;
    }
    if (best == nullptr) return;
    InversePlane plane = map_.planes[from];
    plane.w = plane.at(static_cast<float>(-best->x), static_cast<float>(-best->y));
    try_plane(plane);
  }

  /// To the minimum of the parabola through the costs at three depths.
  void descend(const Pixel& pixel, InversePlane& plane, float& cost) const {
    const auto step = static_cast<float>(options_.parabola_px) * px_;
    std::array<float, kMostSources> unused{};
    InversePlane nearer = plane;
    nearer.w += step;
    InversePlane farther = plane;
    farther.w -= step;
    const float near_cost = cost_of(pixel, nearer, 10.0f, unused);
    const float far_cost = cost_of(pixel, farther, 10.0f, unused);
    const float curvature = near_cost + far_cost - 2.0f * cost;
    if (!(curvature > 1e-6f)) return;
    const float shift = 0.5f * (far_cost - near_cost) / curvature;
    plane.w += step * std::clamp(shift, -1.0f, 1.0f);
  }

  void remember(const Pixel& pixel, const InversePlane& plane,
                const std::array<float, kMostSources>& costs) {
    const std::size_t i = map_.index(pixel.x, pixel.y);
    std::array<float, kMostSources> all{};
    for (int k = 0; k < source_count_; ++k) {
      all[k] = static_cast<float>(map_.source_cost[i][k]) / kCostUnit;
    }
    for (int k = 0; k < pixel.counted; ++k) all[pixel.named[k]] = costs[k];
    if (options_.score_all_sources && pixel.counted < source_count_) {
      std::array<float, kMostSources> rest{};
      std::array<std::uint8_t, kMostSources> others{};
      int count = 0;
      for (int k = 0; k < source_count_; ++k) {
        const auto end = pixel.named.begin() + pixel.counted;
        if (std::find(pixel.named.begin(), end, k) == end) {
          others[count++] = static_cast<std::uint8_t>(k);
        }
      }
      score_plane(pixel.patch, maker_.noise_variance(), center(pixel.x), center(pixel.y), plane,
                  images_.data(), warps_.data(), others.data(), count, rest.data());
      for (int k = 0; k < count; ++k) all[others[k]] = rest[k];
    }
    store(i, all);
  }

  const StereoLevel& reference_;
  const MatchProblem& problem_;
  const SweepOptions& options_;
  const int pass_;
  std::span<const PlaneMap* const> source_maps_;
  PlaneMap& map_;
  const PatchMaker maker_;
  const int source_count_;
  std::array<const QuadImage*, kMostSources> images_{};
  std::array<PixelWarp, kMostSources> warps_{};
  std::array<PixelWarp, kMostSources> back_{};
  float px_ = 0.0f;  ///< inverse depth that moves the projection by a pixel, mean of the sources
  float slope_to_gradient_x_ = 0.0f;
  float slope_to_gradient_y_ = 0.0f;
};

PlaneMap empty_map(const StereoLevel& level) {
  PlaneMap map{level.camera.width, level.camera.height, {}, {}, {}};
  const auto pixels = static_cast<std::size_t>(map.width) * map.height;
  map.planes.resize(pixels);
  map.cost.assign(pixels, kWorstCost);
  map.source_cost.resize(pixels);
  return map;
}

}  // namespace

PlaneMap random_planes(const MatchProblem& problem, const PatchOptions& options) {
  PlaneMap map = empty_map(*problem.reference);
  SweepOptions sweep_options;
  sweep_options.patch = options;
  Sweeper sweeper(problem, sweep_options, 0, {}, map);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (!sweeper.is_specimen(x, y)) continue;
      const std::size_t i = map.index(x, y);
      PixelRandom random(problem.seed, -1, i);
      map.planes[i] = sweeper.random_plane(x, y, random);
      if (map.planes[i].w > 0.0f) sweeper.score_from_scratch(x, y);
    }
  }
  return map;
}

PlaneMap upsampled(const PlaneMap& half, const MatchProblem& problem) {
  PlaneMap map = empty_map(*problem.reference);
  const Sweeper sweeper(problem, SweepOptions{}, 0, {}, map);
  for (int y = 0; y < map.height; ++y) {
    for (int x = 0; x < map.width; ++x) {
      if (!sweeper.is_specimen(x, y)) continue;
      // The parent, or at the outline whichever pixel beside it has a plane.
      std::size_t parent = 0;
      int from_x = -1, from_y = -1;
      const Step around[] = {{0, 0}, {1, 0},   {0, 1},  {-1, 0}, {0, -1},
                             {1, 1}, {-1, -1}, {1, -1}, {-1, 1}};
      for (const Step& step : around) {
        const int u = x / 2 + step.x;
        const int v = y / 2 + step.y;
        if (u < 0 || v < 0 || u >= half.width || v >= half.height) continue;
        if (half.planes[half.index(u, v)].w == 0.0f) continue;
        parent = half.index(u, v);
        from_x = u;
        from_y = v;
        break;
      }
      const std::size_t i = map.index(x, y);
      if (from_x < 0) {
        PixelRandom random(problem.seed, -1, i);
        map.planes[i] = sweeper.random_plane(x, y, random);
        continue;
      }
      InversePlane plane = half.planes[parent];
      plane.gx *= 0.5f;
      plane.gy *= 0.5f;
      plane.w = plane.at(static_cast<float>(x) + 0.5f - static_cast<float>(2 * from_x + 1),
                         static_cast<float>(y) + 0.5f - static_cast<float>(2 * from_y + 1));
      map.planes[i] = plane;
      map.cost[i] = half.cost[parent];
      map.source_cost[i] = half.source_cost[parent];
    }
  }
  return map;
}

void sweep(const MatchProblem& problem, const SweepOptions& options, int pass,
           std::span<const PlaneMap* const> source_maps, PlaneMap& map) {
  Sweeper(problem, options, pass, source_maps, map).run();
}

}  // namespace skullstation
