#pragma once

#include <optional>

#include "core/result.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/volume_options.h"

namespace skullstation {

/// Most frequent value among those at least 400 below soft tissue's: the air round the head, -1000
/// HU by definition. Nothing if there is no such peak of at least 2 % of the voxels.
std::optional<int> air_peak(const Volume& volume);

/// Applies the offset that the options give or ask to infer, with a warning that says so. Fails
/// with `bad_input` where no known offset (0, -1000, -1024) brings the air to -1000 within 60 HU.
Result<void> apply_hu_offset(Volume& volume, const VolumeReadOptions& options,
                             const std::string& name);

}  // namespace skullstation
