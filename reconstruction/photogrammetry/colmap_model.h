#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/image.h"
#include "core/progress.h"
#include "core/result.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// A photograph as structure from motion gets it.
struct SfmImage {
  int camera = 0;  ///< index of its SfmCamera
  const Image8* photograph = nullptr;
  Image8 mask;  ///< 0 where features don't count; the photograph's size, or empty
};

struct SfmCamera {
  int width = 0;
  int height = 0;
  std::optional<Lens> lens;  ///< kept as it is; absent: estimated, the principal point last
};

/// A point of the specimen and where views show it.
struct SfmPoint {
  struct Sight {
    int image = 0;
    Eigen::Vector2d position_px;
  };
  Eigen::Vector3d x_model;
  std::vector<Sight> sights;
};

/// What structure from motion found, in a frame and unit of its own.
struct SfmModel {
  std::vector<std::optional<Rigid3>> camera_from_model;  ///< one an image
  std::vector<Lens> lenses;                              ///< one a camera; fx 0: none of its images
  std::vector<SfmPoint> points;
};

struct SfmOptions {
  std::string program = "colmap";
  std::filesystem::path work_folder;  ///< exists; everything in it is the run's
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all
};

/// Features, matches of the pairs named, incremental mapping (COLMAP 3.8's command line;
/// Schönberger & Frahm 2016); the largest connected model. With several threads the order in which
/// COLMAP samples is not fixed, so that results differ within their noise from run to run. Errors:
/// bad_input if COLMAP is not there, no_result with the log's last lines if it fails or connects
/// fewer than 3 images, cancelled.
Result<SfmModel> structure_from_motion(std::span<const SfmImage> images,
                                       std::span<const SfmCamera> cameras,
                                       std::span<const std::pair<int, int>> pairs,
                                       const SfmOptions& options, const Progress& progress);

/// Reads cameras.txt, images.txt and points3D.txt of a COLMAP model whose images are named by
/// their indices (see colmap_image_name()). Errors (bad_input) name the file and line.
Result<SfmModel> read_colmap_model(const std::filesystem::path& folder,
                                   std::span<const SfmImage> images,
                                   std::span<const SfmCamera> cameras);

/// "000012.png".
std::string colmap_image_name(std::size_t index);

}  // namespace skullstation
