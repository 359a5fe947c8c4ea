#pragma once

#include <vector>

#include "reconstruction/registration/input_surface.h"
#include "reconstruction/registration/part_alignment.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// What pulls the template's surface vertices (#boundary_count) where.
struct SkullPairs {
  Eigen::VectorXd weight;  ///< in [0, 1]; 0: no correspondence
  Points3 target;          ///< in the input
  Points3 normal;          ///< of the input there
  std::vector<bool>
      anchored;  ///< holds along the surface, too: a ridge's points, not any surface's
  int count = 0;
  double rms_mm = 0.0;
};

struct PairLimits {
  double distance_mm = 4.0;
  double normal_deg = 35.0;
  /// Pairs count less beyond three times their median, but not before this: what lies far from a
  /// template that lies well elsewhere must still pull at first.
  double least_scale_mm = 0.5;
};

/// The template as it lies now.
struct SkullState {
  const SkullTemplate* skull = nullptr;
  Points3 vertices;      ///< #V x 3
  TriangleMesh surface;  ///< of them, with normals
};

/// The pairs of `more` put in the place of those of `pairs`.
void put_over(SkullPairs& pairs, const SkullPairs& more);

SkullState state_of(const SkullTemplate& skull, Points3 vertices);

/// Where the parts' own transforms bring their outer vertices (from the rest state's `surface`).
SkullPairs part_pairs(const SkullState& rest, const PartAlignment& parts, const InputSurface& input,
                      const PairLimits& limits, int threads);

/// Each point of the input chooses the vertex nearest in place and direction (OrientedPointTree);
/// an outer vertex goes to the middle of those that chose it. With `both_ways` one that none chose
/// goes to the point that it chooses itself: for what lies far off, since at a break that is the
/// edge.
SkullPairs alike_pairs(const SkullState& state, const InputSurface& input, const PairLimits& limits,
                       bool both_ways, int threads);

/// Outer vertices where the template bends most, each with the nearest such point of the input.
SkullPairs ridge_pairs(const SkullState& state, const std::vector<bool>& ridge,
                       const InputSurface& input, const PairLimits& limits, int threads);

/// The paper's two-way search: from the input's points to template vertices, pruned by distance and
/// normal; from the vertices found to points of the input's surface, pruned by normal. Vertices on
/// the inside of the bone take part with little weight if `inner_weight` is above 0.
SkullPairs two_way_pairs(const SkullState& state, const InputSurface& input,
                         const PairLimits& limits, double inner_weight, int threads);

}  // namespace skullstation
