#pragma once

#include <filesystem>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "reconstruction/approximation/face_estimate.h"

namespace skullstation {

/// Depths known at landmarks of the template: a line "landmark,depth_mm[,sd_mm]" each (1 mm where
/// no standard deviation is given), a heading line, empty lines and such that begin with # are
/// passed over. A bilateral landmark without "left" or "right" stands for both. `name` is what
/// errors call the text; they name the line.
Result<std::vector<KnownDepth>> parse_known_depths(std::string_view text, std::string_view name,
                                                   const SkullTemplate& skull);

Result<std::vector<KnownDepth>> read_known_depths(const std::filesystem::path& file,
                                                  const SkullTemplate& skull);

}  // namespace skullstation
