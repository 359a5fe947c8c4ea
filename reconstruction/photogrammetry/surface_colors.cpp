#include "reconstruction/photogrammetry/surface_colors.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "core/parallel.h"
#include "reconstruction/photogrammetry/exposure_gains.h"

namespace skullstation {

namespace {

constexpr int kBatch = 4096;

/// Mean strength of the finest detail in a view, relative to its light: low for a blurred one.
double sharpness_of(const StereoView& view) {
  const Image8 grey = grey_of(view.color);
  double detail = 0.0, light = 0.0;
  for (int y = 1; y + 1 < grey.height; y += 2) {
    for (int x = 1; x + 1 < grey.width; ++x) {
      if (view.mask.at(x, y) != 255) continue;
      const int bend = 4 * grey.at(x, y) - grey.at(x - 1, y) - grey.at(x + 1, y) -
                       grey.at(x, y - 1) - grey.at(x, y + 1);
      detail += std::abs(bend);
      light += grey.at(x, y);
    }
  }
  return light > 0.0 ? detail / light : 0.0;
}

struct Candidate {
  int view = 0;
  float weight = 0.0f;
  float light = 0.0f;
};

float median_light(std::vector<Candidate> candidates) {
  const auto middle = candidates.begin() + static_cast<std::ptrdiff_t>(candidates.size() / 2);
  std::nth_element(candidates.begin(), middle, candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.light < b.light; });
  return middle->light;
}

/// The best candidates, each less the weight of the first that is left out.
ColorMix mix_of(std::vector<Candidate>& candidates) {
  std::sort(candidates.begin(), candidates.end(), [](const Candidate& a, const Candidate& b) {
    return a.weight != b.weight ? a.weight > b.weight : a.view < b.view;
  });
  ColorMix mix;
  const std::size_t count = std::min<std::size_t>(candidates.size(), ColorMix::kMost);
  const float least = candidates.size() > ColorMix::kMost ? candidates[count].weight : 0.0f;
  float sum = 0.0f;
  for (std::size_t k = 0; k < count; ++k) sum += candidates[k].weight - least;
  if (!(sum > 0.0f)) return mix;
  for (std::size_t k = 0; k < count; ++k) {
    mix.view[k] = static_cast<std::int16_t>(candidates[k].view);
    mix.weight[k] = (candidates[k].weight - least) / sum;
  }
  return mix;
}

}  // namespace

SurfaceColors::SurfaceColors(const TriangleMesh& mesh, const Sights& sights, int threads)
    : mesh_(mesh),
      views_(sights.views()),
      gains_(exposure_gains(mesh, sights)),
      mixes_(static_cast<std::size_t>(mesh.vertices.rows())) {
  std::vector<float> merit(views_.size());
  parallel_for(static_cast<int>(views_.size()), threads,
               [&](int v) { merit[v] = static_cast<float>(sharpness_of(views_[v])); });
  const float sharpest = merit.empty() ? 1.0f : *std::max_element(merit.begin(), merit.end());
  for (float& m : merit) m = sharpest > 0.0f ? m * m / (sharpest * sharpest) : 1.0f;
  const auto count = static_cast<int>(mesh.vertices.rows());
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    std::vector<Candidate> candidates;
    for (int i = batch * kBatch; i < std::min(count, (batch + 1) * kBatch); ++i) {
      const Eigen::Vector3d point = mesh.vertices.row(i);
      const Eigen::Vector3d normal = mesh.normals.row(i);
      candidates.clear();
      for (std::size_t v = 0; v < views_.size(); ++v) {
        const auto sight = sights.of(v, point, normal);
        if (!sight) continue;
        // Highlights and blur grow with the slant.
        const double pixels_per_mm = views_[v].camera.fx / sight->depth_mm;
        const double weight =
            std::pow(sight->cosine, 6.0) * pixels_per_mm * pixels_per_mm * merit[v];
        const auto view = static_cast<int>(v);
        candidates.push_back({view, static_cast<float>(weight), equalised(view, point).sum()});
      }
      if (candidates.empty()) continue;
      if (candidates.size() >= 3) {
        const float usual = std::max(median_light(candidates), 0.01f);
        for (Candidate& candidate : candidates) {
          const float off = (candidate.light / usual - 1.0f) / 0.2f;
          candidate.weight /= 1.0f + off * off * off * off;
        }
      }
      mixes_[i] = mix_of(candidates);
    }
  });
}

Eigen::Vector3f SurfaceColors::equalised(int v, const Eigen::Vector3d& point) const {
  const StereoView& view = views_[v];
  const Eigen::Vector2d pixel = view.camera.project(view.camera_from_table * point);
  return gains_[v] * linear_light_at(view.color, pixel);
}

bool SurfaceColors::light_at(const Eigen::Vector3d& point, std::span<const int, 3> corners,
                             const Eigen::Vector3f& barycentric, Eigen::Vector3f& light) const {
  std::array<int, 3 * ColorMix::kMost> view{};
  std::array<float, 3 * ColorMix::kMost> weight{};
  int count = 0;
  for (int c = 0; c < 3; ++c) {
    const ColorMix& mix = mixes_[corners[c]];
    for (int k = 0; k < ColorMix::kMost && mix.view[k] >= 0; ++k) {
      const auto end = view.begin() + count;
      const auto found = std::find(view.begin(), end, mix.view[k]);
      if (found == end) view[count++] = mix.view[k];
      weight[found - view.begin()] += barycentric[c] * mix.weight[k];
    }
  }
  light.setZero();
  float sum = 0.0f;
  for (int k = 0; k < count; ++k) {
    if (weight[k] <= 0.0f) continue;
    light += weight[k] * equalised(view[k], point);
    sum += weight[k];
  }
  if (sum <= 0.0f) return false;
  light /= sum;
  return true;
}

Colors SurfaceColors::vertex_colors(int threads) const {
  const auto count = static_cast<int>(mesh_.vertices.rows());
  Colors colors = Colors::Constant(count, 3, 128);
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    for (int i = batch * kBatch; i < std::min(count, (batch + 1) * kBatch); ++i) {
      const std::array<int, 3> corners{i, i, i};
      Eigen::Vector3f light;
      if (!light_at(mesh_.vertices.row(i), corners, {1.0f, 0.0f, 0.0f}, light)) continue;
      const auto srgb = srgb_of(light);
      for (int c = 0; c < 3; ++c) colors(i, c) = srgb[c];
    }
  });
  return colors;
}

}  // namespace skullstation
