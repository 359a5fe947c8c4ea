#include "reconstruction/photogrammetry/depth_agreement.h"

#include <cmath>
#include <utility>

#include "core/parallel.h"

namespace skullstation {

namespace {

/// In pixels of the depth maps.
struct Limits {
  float back_px = 1.0f;
  float depth_px = 1.0f;
};

/// Does the source's own depth confirm that its surface lies where the reference puts it?
bool confirms(const DepthMap& source, const PixelWarp& to, const PixelWarp& back, float x, float y,
              float w, const Limits& limits) {
  const float z = to.a[6] * x + to.a[7] * y + to.a[8] + to.b[2] * w;
  const float u = (to.a[0] * x + to.a[1] * y + to.a[2] + to.b[0] * w) / z;
  const float v = (to.a[3] * x + to.a[4] * y + to.a[5] + to.b[1] * w) / z;
  if (!(z > 0.0f && u >= 0.0f && v >= 0.0f && u < static_cast<float>(source.camera.width) &&
        v < static_cast<float>(source.camera.height))) {
    return false;
  }
  const int column = static_cast<int>(u);
  const int row = static_cast<int>(v);
  const InversePlane& plane = source.planes[source.index(column, row)];
  if (plane.w == 0.0f) return false;
  const float there =
      plane.at(u - static_cast<float>(column) - 0.5f, v - static_cast<float>(row) - 0.5f);
  // z / w is the point's depth in the source's camera; the pixel's size there is depth / f. On a
  // slanted surface, half a pixel aside makes a difference in depth, too.
  const float expected = w / z;
  const float focal = static_cast<float>(source.camera.fx);
  const float slope = std::hypot(plane.gx, plane.gy) * focal / plane.w;
  const float limit = limits.depth_px / focal * (1.0f + slope);
  if (!(std::abs(there - expected) <= limit * expected)) return false;
  const float bz = back.a[6] * u + back.a[7] * v + back.a[8] + back.b[2] * there;
  const float bx = (back.a[0] * u + back.a[1] * v + back.a[2] + back.b[0] * there) / bz;
  const float by = (back.a[3] * u + back.a[4] * v + back.a[5] + back.b[1] * there) / bz;
  return std::hypot(bx - x, by - y) <= limits.back_px;
}

}  // namespace

std::vector<std::uint8_t> count_agreement(std::span<const DepthMap> maps, int reference,
                                          const DepthMapOptions& options) {
  const DepthMap& map = maps[reference];
  const auto reduction = static_cast<float>(1 << options.finest_level);
  const Limits limits{static_cast<float>(options.agreement_px) / reduction,
                      static_cast<float>(options.agreement_depth_px) / reduction};
  std::vector<std::uint8_t> count(map.planes.size(), 0);
  for (const int other : map.sources) {
    const DepthMap& source = maps[other];
    const PixelWarp to =
        pixel_warp(map.camera, map.camera_from_table, source.camera, source.camera_from_table);
    const PixelWarp back =
        pixel_warp(source.camera, source.camera_from_table, map.camera, map.camera_from_table);
    for (int y = 0; y < map.camera.height; ++y) {
      for (int x = 0; x < map.camera.width; ++x) {
        const std::size_t i = map.index(x, y);
        const float w = map.planes[i].w;
        if (w == 0.0f) continue;
        count[i] += confirms(source, to, back, static_cast<float>(x) + 0.5f,
                             static_cast<float>(y) + 0.5f, w, limits)
                        ? 1
                        : 0;
      }
    }
  }
  return count;
}

void keep_confirmed(std::vector<DepthMap>& maps, const DepthMapOptions& options) {
  const auto count = static_cast<int>(maps.size());
  std::vector<std::vector<std::uint8_t>> agreement(count);
  parallel_for(count, options.threads,
               [&](int v) { agreement[v] = count_agreement(maps, v, options); });
  parallel_for(count, options.threads, [&](int v) {
    DepthMap& map = maps[v];
    map.agreement = std::move(agreement[v]);
    for (std::size_t i = 0; i < map.planes.size(); ++i) {
      if (map.agreement[i] < options.least_agreement || map.cost[i] > options.worst_cost) {
        map.planes[i] = {};
      }
    }
  });
}

}  // namespace skullstation
