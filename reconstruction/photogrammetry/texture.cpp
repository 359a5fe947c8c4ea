#include "reconstruction/photogrammetry/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>

#include "core/parallel.h"
#include "reconstruction/photogrammetry/exposure_gains.h"
#include "reconstruction/photogrammetry/texture_charts.h"

namespace skullstation {

namespace {

/// Texels around each chart that repeat its border, for filters that look beyond it.
constexpr int kMargin_px = 3;
constexpr int kSmallestSide_px = 256;
/// A patch of mid grey in the atlas's corner for triangles that no view sees.
constexpr int kGreyPatch_px = 8;

struct Layout {
  int side_px = 0;
  float scale = 1.0f;              ///< texels per pixel of the charts' views
  std::vector<AtlasPlace> places;  ///< of the charts; the last one is the grey patch's
};

std::vector<Eigen::Vector2i> sizes_of(const std::vector<TextureChart>& charts, float scale) {
  std::vector<Eigen::Vector2i> sizes;
  for (const TextureChart& chart : charts) {
    const Eigen::Vector2f extent = scale * (chart.high - chart.low);
    sizes.emplace_back(static_cast<int>(std::ceil(extent.x())) + 2 * kMargin_px + 1,
                       static_cast<int>(std::ceil(extent.y())) + 2 * kMargin_px + 1);
  }
  sizes.emplace_back(kGreyPatch_px, kGreyPatch_px);
  return sizes;
}

Layout lay_out(const std::vector<TextureChart>& charts, int largest_side_px) {
  Layout layout;
  for (layout.side_px = kSmallestSide_px; layout.side_px <= largest_side_px; layout.side_px *= 2) {
    layout.places = pack_rectangles(sizes_of(charts, 1.0f), layout.side_px);
    if (!layout.places.empty()) return layout;
  }
  layout.side_px = largest_side_px;
  while (layout.places.empty()) {
    layout.scale *= 0.93f;
    layout.places = pack_rectangles(sizes_of(charts, layout.scale), layout.side_px);
    if (layout.scale < 0.01f) break;  // more charts than texels
  }
  return layout;
}

/// Colours a chart's texels, its own and the margin's.
class ChartPainter {
 public:
  ChartPainter(const TriangleMesh& mesh, const SurfaceColors& colors, const TextureChart& chart,
               const AtlasPlace& place, float scale, Image8& atlas)
      : mesh_(mesh), colors_(colors), chart_(chart), place_(place), scale_(scale), atlas_(atlas) {
    const Eigen::Vector2f extent = scale * (chart.high - chart.low);
    width_ = static_cast<int>(std::ceil(extent.x())) + 2 * kMargin_px + 1;
    height_ = static_cast<int>(std::ceil(extent.y())) + 2 * kMargin_px + 1;
    known_.assign(static_cast<std::size_t>(width_) * height_, 0);
  }

  /// From the view's pixels to the atlas's.
  Eigen::Vector2f texel_of(const Eigen::Vector2f& pixel) const {
    return Eigen::Vector2f(static_cast<float>(place_.x), static_cast<float>(place_.y)) +
           local(pixel);
  }

  void paint() {
    for (std::size_t t = 0; t < chart_.triangles.size(); ++t) paint_triangle(t);
    for (int step = 0; step < kMargin_px; ++step) grow();
  }

 private:
  Eigen::Vector2f local(const Eigen::Vector2f& pixel) const {
    return scale_ * (pixel - chart_.low) + Eigen::Vector2f::Constant(kMargin_px + 0.5f);
  }
  std::uint8_t& known(int x, int y) { return known_[static_cast<std::size_t>(y) * width_ + x]; }

  void paint_triangle(std::size_t t) {
    const int f = chart_.triangles[t];
    const std::array<int, 3> corners{mesh_.triangles(f, 0), mesh_.triangles(f, 1),
                                     mesh_.triangles(f, 2)};
    const Eigen::Vector2f a = local(chart_.corners[t][0]);
    const Eigen::Vector2f b = local(chart_.corners[t][1]);
    const Eigen::Vector2f c = local(chart_.corners[t][2]);
    const float area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
    if (area == 0.0f) return;
    const Eigen::Vector2f low = a.cwiseMin(b).cwiseMin(c);
    const Eigen::Vector2f high = a.cwiseMax(b).cwiseMax(c);
    for (int y = static_cast<int>(low.y()); y <= static_cast<int>(high.y()); ++y) {
      for (int x = static_cast<int>(low.x()); x <= static_cast<int>(high.x()); ++x) {
        const Eigen::Vector2f p(static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f);
        const Eigen::Vector2f d = p - a;
        const float to_b = (d.x() * (c.y() - a.y()) - d.y() * (c.x() - a.x())) / area;
        const float to_c = ((b.x() - a.x()) * d.y() - (b.y() - a.y()) * d.x()) / area;
        const Eigen::Vector3f weight(1.0f - to_b - to_c, to_b, to_c);
        if (weight.minCoeff() < 0.0f) continue;
        Eigen::Vector3d point = Eigen::Vector3d::Zero();
        for (int k = 0; k < 3; ++k) point += double{weight[k]} * mesh_.vertices.row(corners[k]);
        Eigen::Vector3f light;
        if (!colors_.light_at(point, corners, weight, light)) continue;
        const auto srgb = srgb_of(light);
        std::copy(srgb.begin(), srgb.end(), &atlas_.at(place_.x + x, place_.y + y));
        known(x, y) = 1;
      }
    }
  }

  /// Unknown texels take the mean of the known ones beside them.
  void grow() {
    std::vector<std::uint8_t> grown = known_;
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        if (known(x, y) != 0) continue;
        std::array<int, 3> sum{};
        int count = 0;
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, height_ - 1); ++v) {
          for (int u = std::max(x - 1, 0); u <= std::min(x + 1, width_ - 1); ++u) {
            if (known(u, v) == 0) continue;
            for (int c = 0; c < 3; ++c) sum[c] += atlas_.at(place_.x + u, place_.y + v, c);
            ++count;
          }
        }
        if (count == 0) continue;
        for (int c = 0; c < 3; ++c) {
          atlas_.at(place_.x + x, place_.y + y, c) =
              static_cast<std::uint8_t>((sum[c] + count / 2) / count);
        }
        grown[static_cast<std::size_t>(y) * width_ + x] = 1;
      }
    }
    known_ = std::move(grown);
  }

  const TriangleMesh& mesh_;
  const SurfaceColors& colors_;
  const TextureChart& chart_;
  const AtlasPlace place_;
  const float scale_;
  Image8& atlas_;
  int width_ = 0;
  int height_ = 0;
  std::vector<std::uint8_t> known_;
};

/// Collects the vertices of the textured mesh: one for each pair of an old vertex and a chart.
class SeamSplitter {
 public:
  SeamSplitter(const TriangleMesh& mesh, TexturedSurface& out)
      : mesh_(mesh), out_(out), last_chart_(mesh.vertices.rows(), -1), number_(last_chart_) {
    out_.mesh.triangles.resize(mesh.triangles.rows(), 3);
  }

  void add(int triangle, int corner, int chart, const Eigen::Vector2f& coordinate) {
    const int v = mesh_.triangles(triangle, corner);
    if (last_chart_[v] != chart) {
      last_chart_[v] = chart;
      number_[v] = static_cast<int>(from_.size());
      from_.push_back(v);
      out_.coordinates.push_back(coordinate);
    }
    out_.mesh.triangles(triangle, corner) = number_[v];
  }

  void finish() {
    const auto count = static_cast<Eigen::Index>(from_.size());
    out_.mesh.vertices.resize(count, 3);
    out_.mesh.normals.resize(count, 3);
    for (Eigen::Index i = 0; i < count; ++i) {
      out_.mesh.vertices.row(i) = mesh_.vertices.row(from_[i]);
      out_.mesh.normals.row(i) = mesh_.normals.row(from_[i]);
    }
  }

 private:
  const TriangleMesh& mesh_;
  TexturedSurface& out_;
  std::vector<int> last_chart_;
  std::vector<int> number_;
  std::vector<int> from_;
};

}  // namespace

Result<void> TextureOptions::validate() const {
  const bool power_of_two = (largest_side_px & (largest_side_px - 1)) == 0;
  if (power_of_two && largest_side_px >= kSmallestSide_px && largest_side_px <= 16384) return {};
  return fail(ErrorKind::usage, "texture options",
              "largest_side_px is a power of 2 from 256 to 16384");
}

Result<TexturedSurface> make_texture(const TriangleMesh& mesh, const Sights& sights,
                                     const SurfaceColors& colors, const TextureOptions& options) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  const std::vector<TextureChart> charts = cut_charts(mesh, sights, options.threads);
  const Layout layout = lay_out(charts, options.largest_side_px);
  if (layout.places.empty()) {
    return fail(ErrorKind::no_result, "texture", "the surface falls into too many charts",
                "allow a larger atlas or thin the mesh out");
  }
  TexturedSurface result;
  result.atlas = Image8(layout.side_px, layout.side_px, 3, 128);
  const auto painter_of = [&](std::size_t c) {
    return ChartPainter(mesh, colors, charts[c], layout.places[c], layout.scale, result.atlas);
  };
  // Charts keep to their own rectangles.
  parallel_for(static_cast<int>(charts.size()), options.threads,
               [&](int c) { painter_of(c).paint(); });

  const float unit = 1.0f / static_cast<float>(layout.side_px);
  SeamSplitter splitter(mesh, result);
  std::vector<bool> charted(mesh.triangles.rows(), false);
  for (std::size_t c = 0; c < charts.size(); ++c) {
    const ChartPainter painter = painter_of(c);
    for (std::size_t t = 0; t < charts[c].triangles.size(); ++t) {
      const int f = charts[c].triangles[t];
      charted[f] = true;
      for (int k = 0; k < 3; ++k) {
        splitter.add(f, k, static_cast<int>(c), unit * painter.texel_of(charts[c].corners[t][k]));
      }
    }
  }
  const AtlasPlace& grey = layout.places.back();
  const Eigen::Vector2f middle(static_cast<float>(grey.x) + 0.5f * kGreyPatch_px,
                               static_cast<float>(grey.y) + 0.5f * kGreyPatch_px);
  for (int f = 0; f < mesh.triangles.rows(); ++f) {
    if (charted[f]) continue;
    for (int k = 0; k < 3; ++k) {
      splitter.add(f, k, static_cast<int>(charts.size()), unit * middle);
    }
  }
  splitter.finish();
  return result;
}

}  // namespace skullstation
