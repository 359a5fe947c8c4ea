#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "reconstruction/photogrammetry/patch_match_lanes.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// A hypothesis: the plane through a pixel's surface point, as inverse depth over the image,
/// 1/z (x, y) = w + gx (x - x0) + gy (y - y0) [1/mm, 1/mm per px]. A plane's inverse depth is
/// linear in the pixel, so that planes are handed on and sampled without any trigonometry.
struct InversePlane {
  float w = 0.0f;  ///< 0: nothing known
  float gx = 0.0f;
  float gy = 0.0f;

  float at(float dx_px, float dy_px) const { return w + gx * dx_px + gy * dy_px; }
};

/// From a reference pixel (x, y, 1) with inverse depth w to a source pixel in homogeneous
/// coordinates: a (x, y, 1)^T + b w, with a = K_s R K_r^-1 and b = K_s t.
struct PixelWarp {
  std::array<float, 9> a{};
  std::array<float, 3> b{};
};
PixelWarp pixel_warp(const Pinhole& reference, const Rigid3& reference_from_table,
                     const Pinhole& source, const Rigid3& source_from_table);

/// A grey image packed for bilinear sampling by one load: each element holds the pixel and its
/// right, lower and lower right neighbours, a byte each from the lowest. #: (width-1) x (height-1).
struct QuadImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint32_t> quads;
};
QuadImage packed_quads(const Image8& grey);

/// The window: 29 pixels of the quincunx lattice within 4.3 px, in 32 lanes of which 3 are idle.
inline constexpr int kPatchSamples = 29;
inline constexpr int kPatchRadius = 4;
struct PatchOffsets {
  alignas(64) std::array<float, kPatchLanes> x{};
  alignas(64) std::array<float, kPatchLanes> y{};
};
const PatchOffsets& patch_offsets();

/// One reference pixel's window: bilateral weights (Yoon & Kweon 2006) that sum to 1 and the
/// weighted, normalised contrast, so that the correlation with a source patch s is
/// sum(contrast s) / sd(s).
struct Patch {
  alignas(64) std::array<float, kPatchLanes> weight{};
  alignas(64) std::array<float, kPatchLanes> contrast{};
  float mean = 0.0f;
};

struct PatchOptions {
  double spatial_sd_px = 4.0;
  double color_sd = 80.0;  ///< grey levels of 255
  double noise_sd = 2.0;   ///< of a grey level: contrast below it says nothing
};

/// Makes patches of one image.
class PatchMaker {
 public:
  explicit PatchMaker(const PatchOptions& options);
  /// Pixels beyond the image or where the mask is black don't count. \pre (x, y) is specimen
  void make(const Image8& grey, const Image8& mask, int x, int y, Patch& patch) const;
  float noise_variance() const { return noise_variance_; }

 private:
  std::array<float, kPatchSamples> spatial_{};
  std::array<float, 256> color_{};
  float noise_variance_;
};

inline constexpr float kWorstCost = 2.0f;

/// 1 - normalised cross-correlation, in [0, 2], of the patch at pixel centre (x, y) with what the
/// plane makes it look at in each of the named sources; kWorstCost where its centre leaves the
/// image. The homography is taken to first order about the centre. Vectorised over the window's
/// lanes with a fixed order of summation: the same bytes on any machine.
void score_plane(const Patch& patch, float noise_variance, float x, float y,
                 const InversePlane& plane, const QuadImage* const* images, const PixelWarp* warps,
                 const std::uint8_t* named, int count, float* costs);

}  // namespace skullstation
