#pragma once

#include <functional>
#include <optional>
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
#include "reconstruction/photogrammetry/texture.h"

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
  /// Mean edge length of the surface [mm]; 0: as it was extracted, about the voxel's size.
  double edge_mm = 0.0;
  /// Openings with a rim up to this long [mm] are closed by a guess, marked as such; 0: none.
  double closed_rim_mm = 0.0;
  /// The textured surface is a coarser one, since its texture carries the fine detail; nothing:
  /// no texture.
  std::optional<TextureOptions> texture = TextureOptions{};
  double textured_edge_voxels = 2.0;
  int threads = 0;  ///< 0: all; for every stage
  /// Told after each stage; for whoever measures.
  std::function<void(std::string_view stage)> after_stage = [](std::string_view) {};

  /// The settings of a quality; the fusion's voxel follows from the size of a pixel on the
  /// specimen.
  static SurfaceOptions of(ReconstructionQuality quality, std::span<const StereoView> views);
  Result<void> validate() const;
};

/// What was closed without having been measured.
struct FilledOpenings {
  std::vector<bool> vertices;  ///< of the mesh: is it a guess? Empty if no closing was asked for
  double area_cm2 = 0.0;
  int closed = 0;
  int left_open = 0;
};

struct ReconstructedSurface {
  TriangleMesh mesh;  ///< table frame, mm; normals, colours
  Coverage coverage;  ///< of the mesh's vertices; 0 for those that are a guess
  FilledOpenings filled;
  std::optional<TexturedSurface> textured;
};

/// The depth maps of all views of one pass: visual hull, then stereo. The same bytes for any number
/// of threads. Errors: bad_input for fewer than 3 views, usage for views of several passes, those
/// of the stages.
Result<std::vector<DepthMap>> find_depths(std::span<const StereoView> views,
                                          const SurfaceOptions& options,
                                          const Progress& progress = {});

/// One surface from depth maps and their views, of one pass or of several that were moved into one
/// frame: fusion, isosurface, colours, coverage, texture. What no two views agree on stays open.
/// The same bytes for any number of threads. Errors: those of the stages; no_result for an empty
/// surface.
Result<ReconstructedSurface> surface_of_depths(std::vector<DepthMap> maps,
                                               std::span<const StereoView> views,
                                               const SurfaceOptions& options,
                                               const Progress& progress = {});

/// From photographs with known cameras and masks, all of one pass, to a metric surface:
/// find_depths(), then surface_of_depths().
Result<ReconstructedSurface> reconstruct_surface(std::span<const StereoView> views,
                                                 const SurfaceOptions& options,
                                                 const Progress& progress = {});

}  // namespace skullstation
