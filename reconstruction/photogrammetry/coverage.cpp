#include "reconstruction/photogrammetry/coverage.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "core/units.h"

namespace skullstation {

namespace {

constexpr int kBatch = 4096;

/// How one view sees a vertex.
struct Sight {
  Eigen::Vector2d pixel;      ///< in the photograph
  Eigen::Vector3d direction;  ///< unit, from the vertex to the camera
  double cosine = 0.0;        ///< between that and the normal
  double depth_mm = 0.0;
};

class Sights {
 public:
  Sights(std::span<const DepthMap> maps, std::span<const StereoView> views, double depth_gap_mm)
      : maps_(maps), views_(views), gap_(depth_gap_mm) {
    for (const StereoView& view : views) centres_.push_back(view.centre_mm());
  }

  std::optional<Sight> of(std::size_t v, const Eigen::Vector3d& point,
                          const Eigen::Vector3d& normal) const {
    Sight sight;
    sight.direction = (centres_[v] - point).normalized();
    sight.cosine = sight.direction.dot(normal);
    if (sight.cosine < std::cos(radians(80.0))) return std::nullopt;
    const StereoView& view = views_[v];
    const Eigen::Vector3d x_camera = view.camera_from_table * point;
    if (x_camera.z() <= 0.0) return std::nullopt;
    sight.depth_mm = x_camera.z();
    sight.pixel = view.camera.project(x_camera);
    const DepthMap& map = maps_[v];
    const Eigen::Vector2d p = map.camera.project(x_camera);
    if (!(p.x() >= 0.0 && p.y() >= 0.0 && p.x() < map.camera.width && p.y() < map.camera.height)) {
      return std::nullopt;
    }
    const float w = map.planes[map.index(static_cast<int>(p.x()), static_cast<int>(p.y()))].w;
    if (w == 0.0f || 1.0 / w < sight.depth_mm - gap_) return std::nullopt;
    return sight;
  }

 private:
  std::span<const DepthMap> maps_;
  std::span<const StereoView> views_;
  double gap_;
  std::vector<Eigen::Vector3d> centres_;
};

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

/// Linear RGB at an image point, bilinear.
Eigen::Vector3f light_at(const Image8& image, const Eigen::Vector2d& point) {
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

/// Lengths of edges that belong to one triangle only.
double border_mm(const TriangleMesh& mesh) {
  std::vector<std::pair<int, int>> sides;
  sides.reserve(3 * mesh.triangles.rows());
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    for (int k = 0; k < 3; ++k) {
      sides.push_back(std::minmax({mesh.triangles(f, k), mesh.triangles(f, (k + 1) % 3)}));
    }
  }
  std::sort(sides.begin(), sides.end());
  double length = 0.0;
  for (std::size_t i = 0; i < sides.size();) {
    std::size_t end = i + 1;
    while (end < sides.size() && sides[end] == sides[i]) ++end;
    if (end == i + 1) {
      length += (mesh.vertices.row(sides[i].first) - mesh.vertices.row(sides[i].second)).norm();
    }
    i = end;
  }
  return length;
}

void for_each_vertex(const TriangleMesh& mesh, int threads, const std::function<void(int)>& work) {
  const auto count = static_cast<int>(mesh.vertices.rows());
  parallel_for((count + kBatch - 1) / kBatch, threads, [&](int batch) {
    const int end = std::min(count, (batch + 1) * kBatch);
    for (int v = batch * kBatch; v < end; ++v) work(v);
  });
}

/// Gains that bring the views' light to a common scale, the mean over all views 1: least squares on
/// the logarithms of the ratios at shared vertices (Brown & Lowe 2007, gain compensation).
std::vector<float> exposure_gains(const TriangleMesh& mesh, const Sights& sights,
                                  std::span<const StereoView> views) {
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
      const double light = light_at(views[v].color, sight->pixel).sum();
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

}  // namespace

Coverage measure_coverage(const TriangleMesh& mesh, std::span<const DepthMap> maps,
                          std::span<const StereoView> views, double depth_gap_mm,
                          double match_sd_px, int threads) {
  const auto count = static_cast<std::size_t>(mesh.vertices.rows());
  Coverage coverage{std::vector<std::uint8_t>(count, 0), std::vector<float>(count, 0.0f),
                    std::vector<float>(count, 0.0f), border_mm(mesh)};
  const Sights sights(maps, views, depth_gap_mm);
  for_each_vertex(mesh, threads, [&](int i) {
    const Eigen::Vector3d point = mesh.vertices.row(i);
    const Eigen::Vector3d normal = mesh.normals.row(i);
    std::vector<Eigen::Vector3d> directions;
    double finest = 0.0;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const auto sight = sights.of(v, point, normal);
      if (!sight) continue;
      directions.push_back(sight->direction);
      const double pixel_mm = sight->depth_mm / views[v].camera.fx;
      finest = finest == 0.0 ? pixel_mm : std::min(finest, pixel_mm);
    }
    coverage.views[i] = static_cast<std::uint8_t>(std::min<std::size_t>(directions.size(), 255));
    coverage.ground_sample_mm[i] = static_cast<float>(finest);
    double least_cosine = 1.0;
    for (std::size_t a = 0; a < directions.size(); ++a) {
      for (std::size_t b = a + 1; b < directions.size(); ++b) {
        least_cosine = std::min(least_cosine, directions[a].dot(directions[b]));
      }
    }
    if (directions.size() < 2) return;
    const double half_angle = 0.5 * std::acos(std::clamp(least_cosine, -1.0, 1.0));
    const double spread = 2.0 * std::max(std::tan(half_angle), 1e-3);
    coverage.accuracy_mm[i] = static_cast<float>(
        finest * match_sd_px / (spread * std::sqrt(static_cast<double>(directions.size()))));
  });
  return coverage;
}

Colors blend_vertex_colors(const TriangleMesh& mesh, std::span<const DepthMap> maps,
                           std::span<const StereoView> views, double depth_gap_mm, int threads) {
  Colors colors = Colors::Constant(mesh.vertices.rows(), 3, 128);
  const Sights sights(maps, views, depth_gap_mm);
  const std::vector<float> gains = exposure_gains(mesh, sights, views);
  for_each_vertex(mesh, threads, [&](int i) {
    const Eigen::Vector3d point = mesh.vertices.row(i);
    const Eigen::Vector3d normal = mesh.normals.row(i);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weight_sum = 0.0f;
    for (std::size_t v = 0; v < views.size(); ++v) {
      const auto sight = sights.of(v, point, normal);
      if (!sight) continue;
      // Frontal views rule: highlights and blur grow with the slant.
      const auto weight = static_cast<float>(std::pow(sight->cosine, 4.0));
      sum += weight * gains[v] * light_at(views[v].color, sight->pixel);
      weight_sum += weight;
    }
    if (weight_sum <= 0.0f) return;
    for (int c = 0; c < 3; ++c) {
      const double value = coded(std::min(1.0f, sum[c] / weight_sum));
      colors(i, c) = static_cast<std::uint8_t>(std::lround(255.0 * value));
    }
  });
  return colors;
}

}  // namespace skullstation
