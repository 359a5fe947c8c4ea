#include "reconstruction/photogrammetry/fusion_volume.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace skullstation {

namespace {

constexpr int kKeyBits = 21;
constexpr int kKeyOffset = 1 << (kKeyBits - 1);

/// Sorts by z, then y, then x.
std::uint64_t key_of(const Eigen::Vector3i& block) {
  const auto part = [](int c) { return static_cast<std::uint64_t>(std::int64_t{c} + kKeyOffset); };
  return part(block.z()) << (2 * kKeyBits) | part(block.y()) << kKeyBits | part(block.x());
}

Eigen::Vector3i block_of(std::uint64_t key) {
  constexpr std::uint64_t mask = (std::uint64_t{1} << kKeyBits) - 1;
  const auto part = [](std::uint64_t bits) { return static_cast<int>(bits & mask) - kKeyOffset; };
  return {part(key), part(key >> kKeyBits), part(key >> (2 * kKeyBits))};
}

void sort_unique(std::vector<std::uint64_t>& keys) {
  std::sort(keys.begin(), keys.end());
  keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
}

/// Blocks within `reach_mm` of the map's surface points.
std::vector<std::uint64_t> blocks_near(const DepthMap& map, double block_mm, double reach_mm) {
  std::vector<std::uint64_t> keys;
  std::vector<std::uint64_t> recent(4, 0);
  std::size_t turn = 0;
  const Rigid3 table_from_camera = map.camera_from_table.inverse();
  const Eigen::Matrix3d rotation = table_from_camera.rotation.toRotationMatrix();
  for (int y = 0; y < map.camera.height; ++y) {
    for (int x = 0; x < map.camera.width; ++x) {
      const float w = map.planes[map.index(x, y)].w;
      if (w == 0.0f) continue;
      const Eigen::Vector3d point =
          rotation * (map.camera.ray(x + 0.5, y + 0.5) / w) + table_from_camera.translation;
      const auto cell = [&](double offset) {
        return Eigen::Vector3i(((point.array() + offset) / block_mm).floor().cast<int>());
      };
      const Eigen::Vector3i low = cell(-reach_mm);
      const Eigen::Vector3i high = cell(reach_mm);
      for (int k = low.z(); k <= high.z(); ++k) {
        for (int j = low.y(); j <= high.y(); ++j) {
          for (int i = low.x(); i <= high.x(); ++i) {
            const std::uint64_t key = key_of({i, j, k});
            // Neighbouring pixels mostly name the same blocks.
            if (std::find(recent.begin(), recent.end(), key) != recent.end()) continue;
            recent[turn++ % recent.size()] = key;
            keys.push_back(key);
          }
        }
      }
    }
    if (keys.size() > 1'000'000) sort_unique(keys);
  }
  sort_unique(keys);
  return keys;
}

/// A view as the integration reads it.
struct FusedView {
  const DepthMap* map = nullptr;
  const StereoView* view = nullptr;
  Eigen::Matrix3f rotation;
  Eigen::Vector3f translation;
  float fx = 0, fy = 0, cx = 0, cy = 0;
  int mask_scale = 1;  ///< mask pixels per depth pixel
};

/// Surfaces more than 80 deg aslant are not measured.
constexpr float kLeastCosine = 0.17f;
/// How far along its line of sight a depth counts, in truncations.
constexpr float kLongestReach = 2.0f;

/// How much a depth counts, in (0, 1]: by its correlation and by the views that confirm it.
float confidence(const DepthMap& map, std::size_t i) {
  const float correlation = std::max(0.05f, 1.0f - map.cost[i]);
  return correlation * correlation * std::min(1.0f, static_cast<float>(map.agreement[i]) / 4.0f);
}

class Integrator {
 public:
  Integrator(std::span<const FusedView> views, const FusionOptions& options)
      : views_(views),
        voxel_(static_cast<float>(options.voxel_mm)),
        truncation_(static_cast<float>(options.voxel_mm * options.truncation_voxels)),
        free_weight_(static_cast<float>(options.free_space_weight)) {}

  void integrate(FusionBlock& block) const {
    std::array<float, kFusionPoints> near_weight{};
    std::array<float, kFusionPoints> all_weight{};
    std::array<float, kFusionPoints> sum{};
    const Eigen::Vector3f corner = (block.at * kFusionBlock).cast<float>() * voxel_;
    for (const FusedView& view : views_) {
      const Eigen::Vector3f step_x = view.rotation.col(0) * voxel_;
      for (int z = 0; z < kFusionBlock; ++z) {
        for (int y = 0; y < kFusionBlock; ++y) {
          const Eigen::Vector3f start =
              corner + Eigen::Vector3f(0.0f, static_cast<float>(y), static_cast<float>(z)) * voxel_;
          Eigen::Vector3f p = view.rotation * start + view.translation;
          const int row = (z * kFusionBlock + y) * kFusionBlock;
          for (int x = 0; x < kFusionBlock; ++x, p += step_x) {
            observe(view, p, sum[row + x], near_weight[row + x], all_weight[row + x]);
          }
        }
      }
    }
    for (int i = 0; i < kFusionPoints; ++i) {
      block.weight[i] = near_weight[i];
      block.distance_mm[i] = all_weight[i] > 0.0f ? sum[i] / all_weight[i] : truncation_;
    }
  }

 private:
  void observe(const FusedView& view, const Eigen::Vector3f& p, float& sum, float& near_weight,
               float& all_weight) const {
    if (p.z() <= 1.0f) return;
    const float inverse = 1.0f / p.z();
    const float u = view.fx * p.x() * inverse + view.cx;
    const float v = view.fy * p.y() * inverse + view.cy;
    const DepthMap& map = *view.map;
    if (!(u >= 0.0f && v >= 0.0f)) return;
    const int column = static_cast<int>(u);
    const int row = static_cast<int>(v);
    if (column >= map.camera.width || row >= map.camera.height) return;
    const std::size_t i = map.index(column, row);
    const InversePlane& plane = map.planes[i];
    if (plane.w == 0.0f) {
      const Image8& mask = view.view->mask;
      const int mask_x =
          std::min(static_cast<int>(u * static_cast<float>(view.mask_scale)), mask.width - 1);
      const int mask_y =
          std::min(static_cast<int>(v * static_cast<float>(view.mask_scale)), mask.height - 1);
      if (mask.at(mask_x, mask_y) < 16) vote_free(sum, all_weight, 1.0f);
      return;
    }
    const float dx = u - static_cast<float>(column) - 0.5f;
    const float dy = v - static_cast<float>(row) - 0.5f;
    const float w = plane.at(dx, dy);
    // The plane's normal over its distance from the camera's centre, by the pixel.
    const float nx = view.fx * plane.gx;
    const float ny = view.fy * plane.gy;
    const float nz = w - plane.gx * (u - view.cx) - plane.gy * (v - view.cy);
    const float normal = std::sqrt(nx * nx + ny * ny + nz * nz);
    const float distance = (1.0f - w * p.z()) / normal;
    if (!(w > 0.0f && distance >= -truncation_)) return;
    const float ray = std::sqrt(p.x() * p.x() + p.y() * p.y() + p.z() * p.z()) * inverse;
    const float cosine = w / (normal * ray);
    if (cosine < kLeastCosine) return;
    const float weight = confidence(map, i) * cosine;
    // A plane seen nearly edge-on runs on along the line of sight: it holds near its pixel only.
    const float before = (1.0f / w - p.z()) * ray;
    if (before < -kLongestReach * truncation_) return;
    if (distance > truncation_ || before > kLongestReach * truncation_) {
      vote_free(sum, all_weight, weight);
      return;
    }
    const float behind = distance < 0.0f ? 1.0f + distance / truncation_ : 1.0f;
    sum += weight * behind * distance;
    near_weight += weight * behind;
    all_weight += weight * behind;
  }

  void vote_free(float& sum, float& all_weight, float weight) const {
    sum += free_weight_ * weight * truncation_;
    all_weight += free_weight_ * weight;
  }

  std::span<const FusedView> views_;
  const float voxel_;
  const float truncation_;
  const float free_weight_;
};

}  // namespace

int FusionVolume::find(const Eigen::Vector3i& at) const {
  const auto before = [](const FusionBlock& block, const Eigen::Vector3i& wanted) {
    return key_of(block.at) < key_of(wanted);
  };
  const auto found = std::lower_bound(blocks.begin(), blocks.end(), at, before);
  if (found == blocks.end() || found->at != at) return -1;
  return static_cast<int>(found - blocks.begin());
}

Result<void> FusionOptions::validate() const {
  const auto refuse = [](const char* what) {
    return fail(ErrorKind::usage, "fusion options", what);
  };
  if (!(voxel_mm >= 0.05 && voxel_mm <= 20.0)) return refuse("voxel_mm is 0.05 to 20");
  if (!(truncation_voxels >= 1.5 && truncation_voxels <= 7.0)) {
    return refuse("truncation_voxels is 1.5 to 7");
  }
  if (!(free_space_weight >= 0.0) || !(least_weight >= 0.0)) {
    return refuse("weights can't be negative");
  }
  return {};
}

Result<FusionVolume> fuse_depth_maps(std::span<const DepthMap> maps,
                                     std::span<const StereoView> views,
                                     const FusionOptions& options, const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  const auto count = static_cast<int>(maps.size());
  const double truncation_mm = options.voxel_mm * options.truncation_voxels;
  std::vector<std::vector<std::uint64_t>> keys_of_view(count);
  parallel_for(count, options.threads, [&](int v) {
    keys_of_view[v] = blocks_near(maps[v], kFusionBlock * options.voxel_mm, truncation_mm);
  });
  std::vector<std::uint64_t> keys;
  for (const std::vector<std::uint64_t>& some : keys_of_view) {
    keys.insert(keys.end(), some.begin(), some.end());
  }
  keys_of_view.clear();
  sort_unique(keys);
  if (keys.empty()) {
    return fail(ErrorKind::no_result, "fusion", "no view has any depth",
                "check focus, light and poses: stereo found nothing that two views agree on");
  }

  std::vector<FusedView> fused(count);
  for (int v = 0; v < count; ++v) {
    const DepthMap& map = maps[v];
    fused[v] = {&map,
                &views[v],
                map.camera_from_table.rotation.toRotationMatrix().cast<float>(),
                map.camera_from_table.translation.cast<float>(),
                static_cast<float>(map.camera.fx),
                static_cast<float>(map.camera.fy),
                static_cast<float>(map.camera.cx),
                static_cast<float>(map.camera.cy),
                static_cast<int>(std::lround(views[v].camera.fx / map.camera.fx))};
  }
  FusionVolume volume;
  volume.voxel_mm = options.voxel_mm;
  volume.blocks.resize(keys.size());
  const Integrator integrator(fused, options);
  constexpr std::size_t kBatch = 64;
  const auto batches = static_cast<int>((keys.size() + kBatch - 1) / kBatch);
  parallel_for(batches, options.threads, [&](int batch) {
    if (progress.stop.stop_requested()) return;
    const std::size_t end = std::min(keys.size(), (batch + 1) * kBatch);
    for (std::size_t b = batch * kBatch; b < end; ++b) {
      volume.blocks[b].at = block_of(keys[b]);
      integrator.integrate(volume.blocks[b]);
    }
  });
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "fusion", "cancelled");
  progress.report(1.0, "fusion");
  return volume;
}

}  // namespace skullstation
