#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/photogrammetry/patch_match.h"
#include "reconstruction/photogrammetry/stereo_view.h"
#include "reconstruction/photogrammetry/visual_hull.h"

namespace skullstation {

/// What stereo found in one view.
struct DepthMap {
  Pinhole camera;
  Rigid3 camera_from_table;
  int pass = 0;
  std::vector<InversePlane> planes;     ///< row-major; w = 0: no depth
  std::vector<std::uint8_t> agreement;  ///< sources whose own depth confirms the pixel
  std::vector<float> cost;              ///< 1 - correlation, mean over the views that count
  std::vector<int> sources;             ///< the views it was matched with

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * camera.width + x; }
};

struct DepthMapOptions {
  int source_views = 8;  ///< per view, in [2, 8]
  int finest_level = 0;  ///< 0: the photographs' size, 1: half of it, 2: a quarter
  int coarsest_level = 3;
  int finest_rounds = 2;      ///< of geometric consistency on the finest level, 1 or 2
  int hull_resolution = 112;  ///< voxels along the longest side
  /// Confirmation by another view: forward-backward error and difference in depth, at most, in
  /// pixels of the photographs and their size on the specimen.
  double agreement_px = 2.0;
  double agreement_depth_px = 3.0;
  int least_agreement = 2;  ///< views that must confirm a depth
  double worst_cost = 0.7;  ///< a depth of a higher cost is dropped
  std::uint64_t seed = 1;
  int threads = 0;

  Result<void> validate() const;
};

/// A depth map of every view, coarse to fine: photometric sweeps on the coarsest level, then
/// rounds with geometric consistency on each (Xu & Tao 2019), each round after all views are done
/// with the last. `hull` bounds all depths. A depth for every pixel of the specimen, right or
/// wrong, without agreement. The same bytes for any number of threads. Fails with `bad_input` for a
/// view that has no other within a useful angle, `cancelled` on request.
Result<std::vector<DepthMap>> match_depth_maps(std::span<const StereoView> views,
                                               const VisualHull& hull,
                                               const DepthMapOptions& options,
                                               const Progress& progress);

/// match_depth_maps() and then keep_confirmed().
Result<std::vector<DepthMap>> compute_depth_maps(std::span<const StereoView> views,
                                                 const VisualHull& hull,
                                                 const DepthMapOptions& options,
                                                 const Progress& progress);

}  // namespace skullstation
