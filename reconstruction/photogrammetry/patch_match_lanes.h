#pragma once

#include <cstddef>
#include <cstdint>

namespace skullstation {

/// Samples of a window: 29 and 3 idle ones.
inline constexpr int kPatchLanes = 32;

/// The arguments of score_plane() as plain numbers. This header is compiled once for each width of
/// vectors, with that width's compiler flags; so it must not call any function that another file
/// might define, too.
struct ScoreInput {
  struct Source {
    const std::uint32_t* quads;
    int width, height;
    const float* a;  ///< PixelWarp
    const float* b;
  };
  static constexpr float kOutside = 2.0f;

  const float* offset_x;  ///< of the window's lanes [px]
  const float* offset_y;
  const float* weight;
  const float* contrast;
  float mean;
  float noise_variance;
  float x, y;       ///< the pixel's centre
  float w, gx, gy;  ///< InversePlane
  int count;
  Source sources[8];
};

void score_portable(const ScoreInput& in, float* costs);
void score_avx2(const ScoreInput& in, float* costs);
void score_avx512(const ScoreInput& in, float* costs);

/// Vectors of W lanes. Lanes are summed in the same order whatever W is and multiply-add is never
/// fused, so that all widths give the same bytes.
template <int W>
struct Lanes {
  typedef float Float __attribute__((vector_size(4 * W)));
  typedef std::int32_t Int __attribute__((vector_size(4 * W)));
};

/// The view's correlation over the lanes, from (u0, v0) with the given steps per window pixel.
struct LaneWarp {
  float u0, v0, ux, uy, vx, vy;
};

template <class Gather>
[[gnu::always_inline]] inline float correlation_cost(const ScoreInput& in,
                                                     const ScoreInput::Source& image,
                                                     const LaneWarp& warp) {
  constexpr int W = Gather::kWidth;
  using Float = typename Lanes<W>::Float;
  using Int = typename Lanes<W>::Int;
  constexpr int kVectors = kPatchLanes / W;
  const Float last_x = Float{} + static_cast<float>(image.width - 1);
  const Float last_y = Float{} + static_cast<float>(image.height - 1);
  const Float zero{};
  Float sum[kVectors];
  Float square[kVectors];
  Float product[kVectors];
  for (std::ptrdiff_t k = 0; k < kVectors; ++k) {
    Float offset_x, offset_y, weight, contrast;
    __builtin_memcpy(&offset_x, in.offset_x + k * W, sizeof offset_x);
    __builtin_memcpy(&offset_y, in.offset_y + k * W, sizeof offset_y);
    __builtin_memcpy(&weight, in.weight + k * W, sizeof weight);
    __builtin_memcpy(&contrast, in.contrast + k * W, sizeof contrast);
    Float s = warp.u0 + warp.ux * offset_x + warp.uy * offset_y;
    Float t = warp.v0 + warp.vx * offset_x + warp.vy * offset_y;
    s = s > zero ? s : zero;
    s = s < last_x ? s : last_x;
    t = t > zero ? t : zero;
    t = t < last_y ? t : last_y;
    const Int column = __builtin_convertvector(s, Int);
    const Int row = __builtin_convertvector(t, Int);
    const Float fs = s - __builtin_convertvector(column, Float);
    const Float ft = t - __builtin_convertvector(row, Float);
    Int quad;
    Gather::load(image.quads, row * image.width + column, quad);
    const Float q00 = __builtin_convertvector(quad & 255, Float);
    const Float q10 = __builtin_convertvector((quad >> 8) & 255, Float);
    const Float q01 = __builtin_convertvector((quad >> 16) & 255, Float);
    const Float q11 = __builtin_convertvector((quad >> 24) & 255, Float);
    const Float upper = q00 + fs * (q10 - q00);
    const Float lower = q01 + fs * (q11 - q01);
    const Float value = upper + ft * (lower - upper) - in.mean;
    const Float weighted = weight * value;
    sum[k] = weighted;
    square[k] = weighted * value;
    product[k] = contrast * value;
  }
  // Pairwise: lanes 16 apart, 8 apart, and so on.
  for (int half = kVectors / 2; half > 0; half /= 2) {
    for (int k = 0; k < half; ++k) {
      sum[k] += sum[k + half];
      square[k] += square[k + half];
      product[k] += product[k + half];
    }
  }
  const auto total = [](const Float& lanes) __attribute__((always_inline)) {
    typedef float Four __attribute__((vector_size(16)));
    Four parts[W / 4];
    __builtin_memcpy(parts, &lanes, sizeof lanes);
    for (int half = W / 8; half > 0; half /= 2) {
      for (int k = 0; k < half; ++k) parts[k] += parts[k + half];
    }
    return (parts[0][0] + parts[0][2]) + (parts[0][1] + parts[0][3]);
  };
  const float mean = total(sum[0]);
  const float variance = total(square[0]) - mean * mean;
  return 1.0f - total(product[0]) /
                    __builtin_sqrtf((variance > 0.0f ? variance : 0.0f) + in.noise_variance);
}

template <class Gather>
[[gnu::always_inline]] inline void score_with(const ScoreInput& in, float* costs) {
  for (int k = 0; k < in.count; ++k) {
    const ScoreInput::Source& image = in.sources[k];
    const float* const a = image.a;
    const float* const b = image.b;
    const float z = a[6] * in.x + a[7] * in.y + a[8] + b[2] * in.w;
    const float depth = 1.0f / z;
    const float u = (a[0] * in.x + a[1] * in.y + a[2] + b[0] * in.w) * depth;
    const float v = (a[3] * in.x + a[4] * in.y + a[5] + b[1] * in.w) * depth;
    if (!(z > 0.0f && u >= 1.0f && v >= 1.0f && u <= static_cast<float>(image.width - 1) &&
          v <= static_cast<float>(image.height - 1))) {
      costs[k] = ScoreInput::kOutside;
      continue;
    }
    const float zx = a[6] + b[2] * in.gx;
    const float zy = a[7] + b[2] * in.gy;
    const LaneWarp lanes{u - 0.5f,
                         v - 0.5f,
                         (a[0] + b[0] * in.gx - u * zx) * depth,
                         (a[1] + b[0] * in.gy - u * zy) * depth,
                         (a[3] + b[1] * in.gx - v * zx) * depth,
                         (a[4] + b[1] * in.gy - v * zy) * depth};
    costs[k] = correlation_cost<Gather>(in, image, lanes);
  }
}

}  // namespace skullstation
