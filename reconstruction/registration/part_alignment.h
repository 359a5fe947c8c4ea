#pragma once

#include <Eigen/Geometry>
#include <array>

#include "core/transform.h"
#include "reconstruction/registration/input_surface.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// Where each part of the template goes: each of the two bones as a whole, and from there each
/// region.
struct PartAlignment {
  std::array<Eigen::Affine3d, 2> bones;                ///< by SkullBone
  std::array<Similarity3, kSkullRegionCount> regions;  ///< by SkullRegion, after its bone's
  bool mandible_found = false;
  int parts = 0;
  int accepted = 0;  ///< the others keep what they belong to
};

/// Hierarchical ICP (Gietzen et al. 2017, 2019): the two bones, groups of regions, the regions,
/// each from where its parent went, each with a similarity of its own within bounds. A part that
/// finds too little, or nothing better, stays with its parent. `surface` is the template's, in the
/// input's frame up to a small similarity.
///
/// The cranium, laid on the input and then stretched by an affine map; the mandible goes with it.
PartAlignment align_cranium(const SkullTemplate& skull, const TriangleMesh& surface,
                            const InputSurface& input);

/// The mandible, looked for, closed and opened about its joints, in what the cranium leaves of the
/// input. `bent` has the template's surface vertices as the cranium was fitted so far: of a long
/// face an unbent cranium would leave the jaw above.
void find_mandible(const SkullTemplate& skull, const TriangleMesh& surface, const Points3& bent,
                   const InputSurface& input, PartAlignment& parts);

/// Groups of regions, then the regions.
void align_regions(const SkullTemplate& skull, const TriangleMesh& surface,
                   const InputSurface& input, int threads, PartAlignment& parts);

}  // namespace skullstation
