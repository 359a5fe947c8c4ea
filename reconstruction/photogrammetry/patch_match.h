#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruction/photogrammetry/patch_match_score.h"
#include "reconstruction/photogrammetry/visual_hull.h"

namespace skullstation {

inline constexpr int kMostSources = 8;

/// One view at one level of its pyramid.
struct StereoLevel {
  Pinhole camera;
  Rigid3 camera_from_table;
  Image8 grey;
  Image8 mask;
  QuadImage quads;
};

/// What is known about a view's surface: a plane for each pixel.
struct PlaneMap {
  int width = 0;
  int height = 0;
  std::vector<InversePlane> planes;  ///< w = 0 where there is no specimen
  std::vector<float> cost;           ///< of the plane, mean over the views that count; in [0, 2]
  /// Photometric cost in each source, 100 per unit; what the choice of views goes by.
  std::vector<std::array<std::uint8_t, kMostSources>> source_cost;

  std::size_t index(int x, int y) const { return static_cast<std::size_t>(y) * width + x; }
};

/// A reference with its sources.
struct MatchProblem {
  const StereoLevel* reference = nullptr;
  std::vector<const StereoLevel*> sources;  ///< kMostSources at most
  const HullRange* range = nullptr;         ///< at `range_level` levels more than the reference
  int range_level = 0;
  std::uint64_t seed = 1;
};

/// One pass over all pixels: first those of one colour of the checkerboard, then the others.
struct SweepOptions {
  PatchOptions patch;
  int counted_views = 4;          ///< of the sources: the best at the pixel and around it
  int random_trials = 0;          ///< planes drawn from the whole hull range
  double depth_step_px = 1.0;     ///< reach of the random steps in depth, as disparity
  double slope_step = 0.3;        ///< reach of the random steps in slope (tangent of the slant)
  int refinements = 3;            ///< random steps tried
  double geometric_weight = 0.0;  ///< cost per pixel of forward-backward error; 0: photometric
  double most_geometric_px = 3.0;
  bool score_all_sources = true;  ///< else those that don't count keep their old cost
  double parabola_px = 0.0;       ///< at the end: depth of least cost within this reach; 0: none
};

/// Planes drawn at random from the hull's range, facing the camera, scored in all sources.
PlaneMap random_planes(const MatchProblem& problem, const PatchOptions& options);

/// Planes of a map of half the size, each handed to its four pixels..
PlaneMap upsampled(const PlaneMap& half, const MatchProblem& problem);

/// Slanted-plane PatchMatch (Bleyer et al. 2011) in checkerboard order (Galliani et al. 2015):
/// each pixel tries the best plane from each of four sides (Xu & Tao 2019) and random steps from
/// its own, counting the sources that fit best here and around (after Schoenberger et al. 2016).
/// `source_maps` are the sources' maps as they were before this pass, for the geometric cost
/// (empty if its weight is 0). Random numbers are drawn by pixel, so the result depends on nothing
/// else; `pass` tells the passes apart.
void sweep(const MatchProblem& problem, const SweepOptions& options, int pass,
           std::span<const PlaneMap* const> source_maps, PlaneMap& map);

}  // namespace skullstation
