#pragma once

#include <optional>
#include <vector>

#include "core/transform.h"

namespace skullstation {

/// Views whose camera is known in two frames, `model` without unit.
struct FramePair {
  Rigid3 camera_from_reference;
  Rigid3 camera_from_model;
};

struct FrameFit {
  Similarity3 reference_from_model;
  double scale_error_percent = 0.0;  ///< standard error
};

/// The similarity between two frames from cameras known in both: rotation from the cameras' own
/// directions, scale and shift from their centres; medians throughout, so that some views may be
/// wrong in either frame. Nothing for fewer than 3 views or centres that nearly coincide.
std::optional<FrameFit> fit_frame(const std::vector<FramePair>& views);

/// The camera in the reference's frame: x_camera = R x_reference + t.
Rigid3 in_reference(const Rigid3& camera_from_model, const Similarity3& reference_from_model);

/// A frame from the cameras alone: origin where they look, z where most of them have "up", and the
/// mean distance from there `distance` units.
/// \pre two cameras or more
Similarity3 frame_of_cameras(const std::vector<Rigid3>& camera_from_model, double distance);

}  // namespace skullstation
