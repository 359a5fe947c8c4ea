#pragma once

#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/image.h"
#include "core/result.h"
#include "core/session/session.h"
#include "daemon/station/station.h"
#include "daemon/station/station_config.h"

namespace skullstation {

/// What a camera sees, small, and what the gates of a scan would say of it.
struct CameraPreview {
  std::string jpeg;
  std::string taken;  ///< UTC, ISO 8601
  ViewQuality quality;
  std::optional<std::string> complaint;  ///< the gate that this view would fail
};

/// The last look through each camera. However many people watch, a camera is asked once a second
/// at most, and never while a scan has it.
class CameraPreviews {
 public:
  /// `station` may be null (not open). Errors: StationService::preview().
  Result<CameraPreview> look(const std::string& camera, const Station* station,
                             const StationConfig& config, std::mutex& cameras, const Clock& clock);

 private:
  struct Look {
    CameraPreview preview;
    Instant at;
  };

  std::mutex looking_;  // one look at a time; the others are given the last one
  std::mutex mutex_;    // of the map
  std::map<std::string, Look> last_;
};

/// The mean of blocks of pixels, so many that it becomes no wider than `most_px`.
Image8 shrunk(const Image8& image, int most_px);

}  // namespace skullstation
