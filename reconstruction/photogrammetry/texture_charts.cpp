#include "reconstruction/photogrammetry/texture_charts.h"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/parallel.h"

namespace skullstation {

namespace {

constexpr int kMostCandidates = 8;
constexpr int kRounds = 12;
/// What a side between two charts costs, where the worst choice of a view costs 1.
constexpr float kSeamCost = 0.25f;
constexpr int kBatch = 4096;

struct Choice {
  int view = -1;
  float cost = 1.0f;
};
/// The best views of a triangle, cheapest first; view -1 ends the list.
using Choices = std::array<Choice, kMostCandidates>;

Choices choices_of(const TriangleMesh& mesh, const Sights& sights, int f) {
  std::vector<Choice> found;
  for (std::size_t v = 0; v < sights.views().size(); ++v) {
    // Of the corners: their normals are smoother than the triangle's own.
    double cosine = 0.0, scale = 0.0;
    bool seen = true;
    for (int k = 0; k < 3 && seen; ++k) {
      const int i = mesh.triangles(f, k);
      const auto sight = sights.of(v, mesh.vertices.row(i), mesh.normals.row(i));
      seen = sight.has_value();
      if (!seen) continue;
      cosine += sight->cosine / 3.0;
      scale += sights.views()[v].camera.fx / sight->depth_mm / 3.0;
    }
    if (seen) found.push_back({static_cast<int>(v), static_cast<float>(cosine * scale)});
  }
  std::sort(found.begin(), found.end(), [](const Choice& a, const Choice& b) {
    return a.cost != b.cost ? a.cost > b.cost : a.view < b.view;
  });
  Choices choices{};
  for (std::size_t k = 0; k < std::min<std::size_t>(found.size(), kMostCandidates); ++k) {
    choices[k] = {found[k].view, 1.0f - found[k].cost / found.front().cost};
  }
  return choices;
}

/// Triangles across each side, -1 at the border.
std::vector<std::array<int, 3>> neighbours_of(const TriangleMesh& mesh) {
  struct Side {
    std::uint64_t edge;
    int triangle, side;
  };
  std::vector<Side> sides;
  sides.reserve(static_cast<std::size_t>(mesh.triangles.size()));
  for (int f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const auto [low, high] = std::minmax({mesh.triangles(f, k), mesh.triangles(f, (k + 1) % 3)});
      sides.push_back(
          {static_cast<std::uint64_t>(low) << 32 | static_cast<std::uint32_t>(high), f, k});
    }
  }
  std::sort(sides.begin(), sides.end(), [](const Side& a, const Side& b) {
    return a.edge != b.edge ? a.edge < b.edge : a.triangle < b.triangle;
  });
  std::vector<std::array<int, 3>> neighbours(mesh.triangles.rows(), {-1, -1, -1});
  for (std::size_t i = 0; i + 1 < sides.size(); ++i) {
    if (sides[i].edge != sides[i + 1].edge) continue;
    neighbours[sides[i].triangle][sides[i].side] = sides[i + 1].triangle;
    neighbours[sides[i + 1].triangle][sides[i + 1].side] = sides[i].triangle;
  }
  return neighbours;
}

/// A view for each triangle: iterated conditional modes (Besag 1986), in the triangles' order.
std::vector<int> choose_views(const std::vector<Choices>& choices,
                              const std::vector<std::array<int, 3>>& neighbours) {
  std::vector<int> view(choices.size());
  for (std::size_t f = 0; f < choices.size(); ++f) view[f] = choices[f][0].view;
  for (int round = 0; round < kRounds; ++round) {
    int changed = 0;
    for (std::size_t f = 0; f < choices.size(); ++f) {
      float least = 1e9f;
      int best = view[f];
      for (const Choice& choice : choices[f]) {
        if (choice.view < 0) break;
        float cost = choice.cost;
        for (const int other : neighbours[f]) {
          if (other >= 0 && view[other] != choice.view) cost += kSeamCost;
        }
        if (cost >= least) continue;
        least = cost;
        best = choice.view;
      }
      changed += best != view[f] ? 1 : 0;
      view[f] = best;
    }
    if (changed == 0) break;
  }
  return view;
}

void lay_flat(const TriangleMesh& mesh, const StereoView& view, TextureChart& chart) {
  chart.low.setConstant(1e9f);
  chart.high.setConstant(-1e9f);
  for (const int f : chart.triangles) {
    std::array<Eigen::Vector2f, 3>& corners = chart.corners.emplace_back();
    for (int k = 0; k < 3; ++k) {
      const Eigen::Vector3d point = mesh.vertices.row(mesh.triangles(f, k));
      corners[k] = view.camera.project(view.camera_from_table * point).cast<float>();
      chart.low = chart.low.cwiseMin(corners[k]);
      chart.high = chart.high.cwiseMax(corners[k]);
    }
  }
}

}  // namespace

std::vector<TextureChart> cut_charts(const TriangleMesh& mesh, const Sights& sights, int threads) {
  const auto count = static_cast<int>(mesh.triangles.rows());
  std::vector<Choices> choices(count);
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    for (int f = batch * kBatch; f < std::min(count, (batch + 1) * kBatch); ++f) {
      choices[f] = choices_of(mesh, sights, f);
    }
  });
  const auto neighbours = neighbours_of(mesh);
  const std::vector<int> view = choose_views(choices, neighbours);

  std::vector<TextureChart> charts;
  std::vector<bool> taken(count, false);
  std::vector<int> open;
  for (int seed = 0; seed < count; ++seed) {
    if (taken[seed] || view[seed] < 0) continue;
    TextureChart& chart = charts.emplace_back();
    chart.view = view[seed];
    taken[seed] = true;
    open.assign(1, seed);
    while (!open.empty()) {
      const int f = open.back();
      open.pop_back();
      chart.triangles.push_back(f);
      for (const int other : neighbours[f]) {
        if (other < 0 || taken[other] || view[other] != chart.view) continue;
        taken[other] = true;
        open.push_back(other);
      }
    }
    std::sort(chart.triangles.begin(), chart.triangles.end());
  }
  parallel_for(static_cast<int>(charts.size()), threads,
               [&](int c) { lay_flat(mesh, sights.views()[charts[c].view], charts[c]); });
  return charts;
}

std::vector<AtlasPlace> pack_rectangles(const std::vector<Eigen::Vector2i>& sizes, int side) {
  std::vector<int> order(sizes.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) {
    const auto key = [&](int i) { return std::tuple(-sizes[i].y(), -sizes[i].x(), i); };
    return key(a) < key(b);
  });
  // The skyline: steps from x to the next one's x, each at its height.
  std::vector<AtlasPlace> steps = {{0, 0}};
  std::vector<AtlasPlace> places(sizes.size());
  for (const int i : order) {
    const Eigen::Vector2i& size = sizes[i];
    int best_y = side + 1;
    std::size_t best = 0;
    for (std::size_t s = 0; s < steps.size(); ++s) {
      if (steps[s].x + size.x() > side) break;
      int y = 0;
      for (std::size_t t = s; t < steps.size() && steps[t].x < steps[s].x + size.x(); ++t) {
        y = std::max(y, steps[t].y);
      }
      if (y + size.y() > side || y >= best_y) continue;
      best_y = y;
      best = s;
    }
    if (best_y > side) return {};
    const AtlasPlace place{steps[best].x, best_y};
    places[i] = place;
    // The rectangle's top becomes a step; those below it end or begin later.
    const int end = place.x + size.x();
    std::size_t last = best;
    while (last + 1 < steps.size() && steps[last + 1].x <= end) ++last;
    const bool ends_on_step = steps[last].x == end;
    const AtlasPlace rest{end, steps[last].y};
    const auto begin = steps.begin() + static_cast<std::ptrdiff_t>(best);
    steps.erase(begin, steps.begin() + static_cast<std::ptrdiff_t>(last + (ends_on_step ? 0 : 1)));
    auto at = steps.insert(steps.begin() + static_cast<std::ptrdiff_t>(best),
                           {place.x, place.y + size.y()});
    if (!ends_on_step && end < side) steps.insert(at + 1, rest);
  }
  return places;
}

}  // namespace skullstation
