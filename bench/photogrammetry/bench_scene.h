#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// A simulated scan of one pass with everything known: two rings, at 15 and 45 deg, as the default
/// simulated station has them, with its board, lens distortion, defocus and noise.
struct BenchScene {
  std::string specimen;  ///< PLY file [mm]; empty: the built-in synthetic skull
  int width = 1600;
  int height = 1200;
  int views = 48;  ///< in both rings together
  std::uint64_t seed = 1;
};

/// The folder below `cache` that holds the scene as a capture session with true poses and masks
/// (`session.json`) and `truth.ply`, the specimen's surface in the table frame. Rendered on the
/// first call, minutes for 48 views; kept for the next.
Result<std::filesystem::path> cached_scene(const BenchScene& scene,
                                           const std::filesystem::path& cache, int threads);

}  // namespace skullstation
