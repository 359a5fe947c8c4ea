#pragma once

#include <optional>
#include <vector>

#include "core/transform.h"
#include "reconstruction/photogrammetry/bundle_adjustment.h"
#include "reconstruction/photogrammetry/colmap_model.h"
#include "reconstruction/photogrammetry/poses_rings.h"

namespace skullstation {

/// One an image of a model; nothing where the table's angle is not known or the image doesn't
/// count.
using RingMembers = std::vector<std::optional<RingMembership>>;

/// Views of a model from structure from motion on the circles where the table's angles put them.
struct SfmRings {
  BundleProblem problem;              ///< axis, rings, and the members' views
  std::vector<std::size_t> images;    ///< of the problem's views
  std::vector<double> departures_mm;  ///< ring_departure_mm() of those on a ring, else 0
};

/// Nothing where no axis is found.
std::optional<SfmRings> find_sfm_rings(const SfmModel& model, const Similarity3& frame_from_model,
                                       const RingMembers& members);

/// Adjusts views, points, axis and circles to what the views show, round by round: the better the
/// views keep to their circles, the more those are believed (trust_in_rings()). Sights that lie far
/// off afterwards are taken out. The model is in the frame then, `frame_from_model` the identity.
/// Lenses stay. Does nothing where no axis is found or the views' errors are not determined.
void adjust_to_rings(SfmModel& model, Similarity3& frame_from_model, const RingMembers& members);

}  // namespace skullstation
