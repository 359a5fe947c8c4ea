#include "reconstruction/photogrammetry/exposure_gains.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace skullstation {

namespace {

double linear(double srgb) {
  return srgb <= 0.04045 ? srgb / 12.92 : std::pow((srgb + 0.055) / 1.055, 2.4);
}
double coded(double light) {
  return light <= 0.0031308 ? 12.92 * light : 1.055 * std::pow(light, 1.0 / 2.4) - 0.055;
}

const std::array<float, 256>& linear_table() {
  static const std::array<float, 256> table = [] {
    std::array<float, 256> made{};
    for (int i = 0; i < 256; ++i) made[i] = static_cast<float>(linear(i / 255.0));
    return made;
  }();
  return table;
}

}  // namespace

Eigen::Vector3f linear_light_at(const Image8& image, const Eigen::Vector2d& point) {
  const double u = std::clamp(point.x() - 0.5, 0.0, image.width - 1.001);
  const double v = std::clamp(point.y() - 0.5, 0.0, image.height - 1.001);
  const int x = static_cast<int>(u);
  const int y = static_cast<int>(v);
  const auto fx = static_cast<float>(u - x);
  const auto fy = static_cast<float>(v - y);
  Eigen::Vector3f light;
  for (int c = 0; c < 3; ++c) {
    const int channel = image.channels == 3 ? c : 0;
    const auto value = [&](int i, int j) {
      return linear_table()[image.at(x + i, y + j, channel)];
    };
    light[c] = (1 - fy) * ((1 - fx) * value(0, 0) + fx * value(1, 0)) +
               fy * ((1 - fx) * value(0, 1) + fx * value(1, 1));
  }
  return light;
}

std::array<std::uint8_t, 3> srgb_of(const Eigen::Vector3f& light) {
  std::array<std::uint8_t, 3> srgb{};
  for (int c = 0; c < 3; ++c) {
    const double level = coded(std::clamp(light[c], 0.0f, 1.0f));
    srgb[c] = static_cast<std::uint8_t>(std::lround(255.0 * level));
  }
  return srgb;
}

std::vector<float> exposure_gains(const TriangleMesh& mesh, const Sights& sights) {
  const std::span<const StereoView> views = sights.views();
  const std::size_t count = views.size();
  std::map<std::pair<std::size_t, std::size_t>, std::vector<double>> ratios;
  const Eigen::Index step = std::max<Eigen::Index>(1, mesh.vertices.rows() / 4000);
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); i += step) {
    const Eigen::Vector3d point = mesh.vertices.row(i);
    const Eigen::Vector3d normal = mesh.normals.row(i);
    std::vector<std::pair<std::size_t, double>> seen;
    for (std::size_t v = 0; v < count; ++v) {
      const auto sight = sights.of(v, point, normal);
      if (!sight || sight->cosine < 0.5) continue;
      const double light = linear_light_at(views[v].color, sight->pixel).sum();
      if (light > 0.05) seen.emplace_back(v, std::log(light));
    }
    for (std::size_t a = 0; a < seen.size(); ++a) {
      for (std::size_t b = a + 1; b < seen.size(); ++b) {
        ratios[{seen[a].first, seen[b].first}].push_back(seen[b].second - seen[a].second);
      }
    }
  }
  std::vector<double> gain(count, 0.0);  // logarithms
  for (int round = 0; round < 50; ++round) {
    std::vector<double> sum(count, 0.0), weight(count, 1.0);
    for (auto& [pair, values] : ratios) {
      if (values.size() < 20) continue;
      const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
      if (round == 0) std::nth_element(values.begin(), middle, values.end());
      // Light a exp(gain a) should equal light b exp(gain b).
      const auto n = static_cast<double>(values.size());
      sum[pair.first] += n * (gain[pair.second] + *middle);
      sum[pair.second] += n * (gain[pair.first] - *middle);
      weight[pair.first] += n;
      weight[pair.second] += n;
    }
    for (std::size_t v = 0; v < count; ++v) gain[v] = 0.5 * gain[v] + 0.5 * sum[v] / weight[v];
  }
  std::vector<float> factor(count);
  for (std::size_t v = 0; v < count; ++v) factor[v] = static_cast<float>(std::exp(gain[v]));
  return factor;
}

}  // namespace skullstation
