#include "reconstruction/photogrammetry/patch_match_score.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdlib>

// Copies of the hot loop for wider vectors, chosen when the program starts. Lanes are summed in a
// fixed order and multiply-add is never fused, so all copies give the same bytes.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define SKULLSTATION_WIDE_LANES \
  __attribute__((target_clones("arch=x86-64-v4", "arch=x86-64-v3", "default"), optimize("O3")))
#else
#define SKULLSTATION_WIDE_LANES
#endif

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
  float sum = 0.0f;
  float sum_value = 0.0f;
  for (int i = 0; i < kPatchSamples; ++i) {
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

SKULLSTATION_WIDE_LANES
void score_plane(const Patch& patch, float noise_variance, float x, float y,
                 const InversePlane& plane, const QuadImage* const* images, const PixelWarp* warps,
                 const std::uint8_t* named, int count, float* costs) {
  const float* const offset_x = kLanes.x.data();
  const float* const offset_y = kLanes.y.data();
  const float* const weight = patch.weight.data();
  const float* const contrast = patch.contrast.data();
  for (int k = 0; k < count; ++k) {
    const PixelWarp& warp = warps[named[k]];
    const QuadImage& image = *images[named[k]];
    const auto& a = warp.a;
    const auto& b = warp.b;
    const float z = a[6] * x + a[7] * y + a[8] + b[2] * plane.w;
    const float depth = 1.0f / z;
    const float u = (a[0] * x + a[1] * y + a[2] + b[0] * plane.w) * depth;
    const float v = (a[3] * x + a[4] * y + a[5] + b[1] * plane.w) * depth;
    const auto last_x = static_cast<float>(image.width - 1);
    const auto last_y = static_cast<float>(image.height - 1);
    if (!(z > 0.0f && u >= 1.0f && v >= 1.0f && u <= last_x && v <= last_y)) {
      costs[k] = kWorstCost;
      continue;
    }
    const float zx = a[6] + b[2] * plane.gx;
    const float zy = a[7] + b[2] * plane.gy;
    const float ux = (a[0] + b[0] * plane.gx - u * zx) * depth;
    const float uy = (a[1] + b[0] * plane.gy - u * zy) * depth;
    const float vx = (a[3] + b[1] * plane.gx - v * zx) * depth;
    const float vy = (a[4] + b[1] * plane.gy - v * zy) * depth;
    const float u0 = u - 0.5f;
    const float v0 = v - 0.5f;
    const int stride = image.width;
    const std::uint32_t* const quads = image.quads.data();
    const float mean = patch.mean;

    alignas(64) float sum[kPatchLanes];
    alignas(64) float square[kPatchLanes];
    alignas(64) float product[kPatchLanes];
    for (int i = 0; i < kPatchLanes; ++i) {
      float s = u0 + ux * offset_x[i] + uy * offset_y[i];
      float t = v0 + vx * offset_x[i] + vy * offset_y[i];
      s = s < 0.0f ? 0.0f : s;
      s = s > last_x ? last_x : s;
      t = t < 0.0f ? 0.0f : t;
      t = t > last_y ? last_y : t;
      const int column = static_cast<int>(s);
      const int row = static_cast<int>(t);
      const float fs = s - static_cast<float>(column);
      const float ft = t - static_cast<float>(row);
      const std::uint32_t quad = quads[row * stride + column];
      const auto q00 = static_cast<float>(static_cast<int>(quad & 255u));
      const auto q10 = static_cast<float>(static_cast<int>((quad >> 8) & 255u));
      const auto q01 = static_cast<float>(static_cast<int>((quad >> 16) & 255u));
      const auto q11 = static_cast<float>(static_cast<int>(quad >> 24));
      const float upper = q00 + fs * (q10 - q00);
      const float lower = q01 + fs * (q11 - q01);
      const float value = upper + ft * (lower - upper) - mean;
      sum[i] = weight[i] * value;
      square[i] = weight[i] * value * value;
      product[i] = contrast[i] * value;
    }
    // Pairwise: 16 lanes, 8, 4, 2, 1.
    for (int i = 0; i < 16; ++i) {
      sum[i] += sum[i + 16];
      square[i] += square[i + 16];
      product[i] += product[i + 16];
    }
    for (int i = 0; i < 8; ++i) {
      sum[i] += sum[i + 8];
      square[i] += square[i + 8];
      product[i] += product[i + 8];
    }
    for (int i = 0; i < 4; ++i) {
      sum[i] += sum[i + 4];
      square[i] += square[i + 4];
      product[i] += product[i + 4];
    }
    const auto total = [](const float* lanes) {
      return (lanes[0] + lanes[2]) + (lanes[1] + lanes[3]);
    };
    const float sum_all = total(sum);
    const float variance = total(square) - sum_all * sum_all;
    const float correlation =
        total(product) / std::sqrt((variance > 0.0f ? variance : 0.0f) + noise_variance);
    costs[k] = 1.0f - correlation;
  }
}

}  // namespace skullstation
