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
/// finds too little, or nothing better, stays with its parent. The mandible is looked for closed
/// and opened about its joints; each bone is stretched by an affine map before its regions are
/// looked for. `surface` is the template's, in the input's frame up to a small similarity.
PartAlignment align_parts(const SkullTemplate& skull, const TriangleMesh& surface,
                          const InputSurface& input, int threads);

}  // namespace skullstation
