#pragma once

#include <functional>
#include <span>
#include <string_view>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/coverage.h"
#include "reconstruction/photogrammetry/depth_maps.h"
#include "reconstruction/photogrammetry/fusion_volume.h"
#include "reconstruction/photogrammetry/stereo_view.h"
#include "reconstruction/photogrammetry/surface_cleaning.h"

namespace skullstation {

enum class ReconstructionQuality {
  draft,     ///< depth at half the photographs' size: a look at the result
  standard,  ///< at their full size, followed up once
  fine,      ///< at their full size, followed up twice
};

struct SurfaceOptions {
  DepthMapOptions depth;
  FusionOptions fusion;
  CleaningOptions cleaning;
  /// Standard deviation of a match [px of the depth maps]; for the estimated accuracy.
  double match_sd_px = 0.3;
  int threads = 0;  ///< 0: all; for every stage
  /// Told after each stage; for whoever measures.
  std::function<void(std::string_view stage)> after_stage = [](std::string_view) {};

  /// The settings of a quality; the fusion's voxel follows from the size of a pixel on the
  /// specimen.
  static SurfaceOptions of(ReconstructionQuality quality, std::span<const StereoView> views);
  Result<void> validate() const;
};

struct ReconstructedSurface {
  TriangleMesh mesh;  ///< table frame, mm; normals, colours
  Coverage coverage;  ///< of the mesh's vertices
  std::vector<DepthMap> depth_maps;
};

/// From photographs with known cameras and masks, all of one pass, to a metric surface: visual
/// hull, depth maps, fusion, isosurface, colours, coverage. What no two views agree on stays open.
/// The same bytes for any number of threads. Errors: those of the stages.
Result<ReconstructedSurface> reconstruct_surface(std::span<const StereoView> views,
                                                 const SurfaceOptions& options,
                                                 const Progress& progress = {});

}  // namespace skullstation
