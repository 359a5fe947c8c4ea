#include "reconstruction/photogrammetry/patch_match_score.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>

namespace skullstation {

namespace {

struct Offset {
  int x, y;
};

std::array<Offset, kPatchSamples> make_offsets() {
  std::array<Offset, kPatchSamples> offsets{};
  int count = 0;
  for (int y = -kPatchRadius; y <= kPatchRadius; ++y) {
    for (int x = -kPatchRadius; x <= kPatchRadius; ++x) {
      if ((x + y) % 2 == 0 && x * x + y * y <= 18) offsets[count++] = {x, y};
    }
  }
  return offsets;
}
const std::array<Offset, kPatchSamples> kOffsets = make_offsets();

PatchOffsets make_lanes() {
  PatchOffsets lanes;
  for (int i = 0; i < kPatchSamples; ++i) {
    lanes.x[i] = static_cast<float>(kOffsets[i].x);
    lanes.y[i] = static_cast<float>(kOffsets[i].y);
  }
  return lanes;
}
const PatchOffsets kLanes = make_lanes();

}  // namespace

const PatchOffsets& patch_offsets() { return kLanes; }

PixelWarp pixel_warp(const Pinhole& reference, const Rigid3& reference_from_table,
                     const Pinhole& source, const Rigid3& source_from_table) {
  const Rigid3 source_from_reference = source_from_table * reference_from_table.inverse();
  Eigen::Matrix3d k_source;
  k_source << source.fx, 0.0, source.cx, 0.0, source.fy, source.cy, 0.0, 0.0, 1.0;
  Eigen::Matrix3d k_reference;
  k_reference << reference.fx, 0.0, reference.cx, 0.0, reference.fy, reference.cy, 0.0, 0.0, 1.0;
  const Eigen::Matrix3d a =
      k_source * source_from_reference.rotation.toRotationMatrix() * k_reference.inverse();
  const Eigen::Vector3d b = k_source * source_from_reference.translation;
  PixelWarp warp;
  for (int row = 0; row < 3; ++row) {
    for (int column = 0; column < 3; ++column) {
      warp.a[3 * row + column] = static_cast<float>(a(row, column));
    }
    warp.b[row] = static_cast<float>(b[row]);
  }
  return warp;
}

QuadImage packed_quads(const Image8& grey) {
  QuadImage packed{grey.width - 1, grey.height - 1, {}};
  packed.quads.resize(static_cast<std::size_t>(packed.width) * packed.height);
  for (int y = 0; y < packed.height; ++y) {
    const std::uint8_t* upper = grey.row(y);
    const std::uint8_t* lower = grey.row(y + 1);
    std::uint32_t* out = &packed.quads[static_cast<std::size_t>(y) * packed.width];
    for (int x = 0; x < packed.width; ++x) {
      out[x] = upper[x] | std::uint32_t{upper[x + 1]} << 8 | std::uint32_t{lower[x]} << 16 |
               std::uint32_t{lower[x + 1]} << 24;
    }
  }
  return packed;
}

PatchMaker::PatchMaker(const PatchOptions& options)
    : noise_variance_(static_cast<float>(options.noise_sd * options.noise_sd)) {
  for (int i = 0; i < kPatchSamples; ++i) {
    const double r2 = kOffsets[i].x * kOffsets[i].x + kOffsets[i].y * kOffsets[i].y;
    spatial_[i] =
        static_cast<float>(std::exp(-r2 / (2.0 * options.spatial_sd_px * options.spatial_sd_px)));
  }
  for (int i = 0; i < 256; ++i) {
    const double ratio = i / options.color_sd;
    color_[i] = static_cast<float>(std::exp(-0.5 * ratio * ratio));
  }
}

void PatchMaker::make(const Image8& grey, const Image8& mask, int x, int y, Patch& patch) const {
  std::array<float, kPatchLanes> value{};
  const int stride = grey.width;
  const std::uint8_t* centre = grey.row(y) + x;
  const std::uint8_t* inside = mask.row(y) + x;
  const bool whole = x >= kPatchRadius && y >= kPatchRadius && x < grey.width - kPatchRadius &&
                     y < grey.height - kPatchRadius;
  float sum = 0.0f;
  float sum_value = 0.0f;
  for (int i = 0; i < kPatchSamples; ++i) {
    const int u = x + kOffsets[i].x;
    const int v = y + kOffsets[i].y;
    if (!whole && (u < 0 || v < 0 || u >= grey.width || v >= grey.height)) {
      patch.weight[i] = 0.0f;  // beyond the image
      continue;
    }
    const int at = kOffsets[i].y * stride + kOffsets[i].x;
    const int level = centre[at];
    const float weight =
        spatial_[i] * color_[std::abs(level - *centre)] * static_cast<float>(inside[at]);
    value[i] = static_cast<float>(level);
    patch.weight[i] = weight;
    sum += weight;
    sum_value += weight * value[i];
  }
  const float scale = 1.0f / sum;
  patch.mean = sum_value * scale;
  float variance = 0.0f;
  for (int i = 0; i < kPatchSamples; ++i) {
    patch.weight[i] *= scale;
    const float contrast = value[i] - patch.mean;
    variance += patch.weight[i] * contrast * contrast;
    patch.contrast[i] = patch.weight[i] * contrast;
  }
  const float normal = 1.0f / std::sqrt(variance + noise_variance_);
  for (int i = 0; i < kPatchSamples; ++i) patch.contrast[i] *= normal;
}

namespace {

/// Portable: the compiler makes of it what the machine has.
struct PlainGather {
  static constexpr int kWidth = 4;
  using Int = Lanes<4>::Int;
  static void load(const std::uint32_t* from, const Int& index, Int& out) {
    for (int i = 0; i < 4; ++i) out[i] = static_cast<std::int32_t>(from[index[i]]);
  }
};

using Score = void (*)(const ScoreInput&, float*);

Score choose_score() {
#if defined(__x86_64__)
  __builtin_cpu_init();
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
      __builtin_cpu_supports("avx512vl") && __builtin_cpu_supports("avx512bw")) {
    return score_avx512;
  }
  if (__builtin_cpu_supports("avx2")) return score_avx2;
#endif
  return score_portable;
}

const Score kScore = choose_score();

}  // namespace

void score_portable(const ScoreInput& in, float* costs) { score_with<PlainGather>(in, costs); }

void score_plane(const Patch& patch, float noise_variance, float x, float y,
                 const InversePlane& plane, const QuadImage* const* images, const PixelWarp* warps,
                 const std::uint8_t* named, int count, float* costs) {
  ScoreInput in{};
  in.offset_x = kLanes.x.data();
  in.offset_y = kLanes.y.data();
  in.weight = patch.weight.data();
  in.contrast = patch.contrast.data();
  in.mean = patch.mean;
  in.noise_variance = noise_variance;
  in.x = x;
  in.y = y;
  in.w = plane.w;
  in.gx = plane.gx;
  in.gy = plane.gy;
  in.count = count;
  for (int k = 0; k < count; ++k) {
    const QuadImage& image = *images[named[k]];
    const PixelWarp& warp = warps[named[k]];
    in.sources[k] = {image.quads.data(), image.width, image.height, warp.a.data(), warp.b.data()};
  }
  kScore(in, costs);
}

}  // namespace skullstation
