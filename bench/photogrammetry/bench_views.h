#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/result.h"
#include "reconstruction/photogrammetry/stereo_view.h"

namespace skullstation {

/// What is done to a scene's photographs before they are reconstructed.
struct BenchViewOptions {
  int every = 1;          ///< of each ring's views only every n-th
  int halvings = 0;       ///< of width and height
  double noise_sd = 0.0;  ///< grey levels added, besides the noise that the camera made
  std::uint64_t seed = 1;
  int threads = 0;
};

/// The views of a session whose intrinsics, poses and masks are known.
Result<std::vector<StereoView>> load_bench_views(const std::filesystem::path& folder,
                                                 const BenchViewOptions& options);

}  // namespace skullstation
