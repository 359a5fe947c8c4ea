#pragma once

#include <filesystem>

#include "core/image.h"
#include "core/result.h"
#include "core/session/session.h"

namespace skullstation {

/// All views of a session on one picture, in the order of pass, camera and table angle: a row of
/// `columns` tiles, each `tile_width_px` wide, after the other; a new pass or camera begins a new
/// row. Fails if an image can't be read.
Result<Image8> contact_sheet(const Session& session, const std::filesystem::path& folder,
                             int columns, int tile_width_px, int threads);

}  // namespace skullstation
