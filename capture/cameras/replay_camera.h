#pragma once

#include <filesystem>
#include <memory>
#include <vector>

#include "capture/cameras/camera.h"
#include "core/clock.h"

namespace skullstation {

struct ReplayCameraConfig {
  /// Pictures in the order in which they are served (see pictures_in() for a folder).
  std::vector<std::filesystem::path> pictures;
  /// Start again after the last one; otherwise the next request is an error.
  bool loop = false;
};

/// The PNG, JPEG and TIFF files of a folder, ordered by name with numbers by value (view_2 before
/// view_10). Error (kind bad_input): no such folder, or none in it.
Result<std::vector<std::filesystem::path>> pictures_in(const std::filesystem::path& folder);

/// Serves recorded pictures as frames, one for each call, exposed at the moment that was asked for
/// (`clock` is slept on until then). A recording can't be adjusted: it has no controls, and lock()
/// refuses every setting by name. reopen() goes on with the next picture.
/// Errors of frame_after (kind bad_input): a picture can't be read, has another size than the
/// first, or all were used.
/// Errors of this function (kind bad_input): no pictures, or the first can't be read.
Result<std::unique_ptr<Camera>> open_replay_camera(const ReplayCameraConfig& config, Clock& clock);

}  // namespace skullstation
