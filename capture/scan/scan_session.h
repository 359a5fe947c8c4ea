#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <optional>
#include <stop_token>
#include <string>
#include <string_view>
#include <vector>

#include "capture/cameras/camera.h"
#include "capture/scan/image_quality.h"
#include "capture/scan/scan_plan.h"
#include "core/clock.h"
#include "core/file.h"
#include "core/progress.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "firmware_io/station_hardware.h"

namespace skullstation {

/// A camera of the station under the name that the plan's rings use. It runs and its settings are
/// locked already.
struct ScanCamera {
  std::string id;
  Camera& camera;
  std::optional<Lens> lens;  ///< from `calibrate camera`; absent: left to the reconstruction
  std::optional<double> focal_length_mm;  ///< of the lens, for EXIF
};

/// The specimen must now lie as this pass wants it.
struct PlacementRequest {
  int pass = 0;  ///< 0 upright, 1 turned over, …
  /// Views of this pass are recorded already (an interrupted scan goes on): the specimen must lie
  /// exactly as it did and must not be touched.
  bool continued = false;
};

/// What a scan works with.
struct ScanStation {
  StationHardware& hardware;
  std::vector<ScanCamera> cameras;
  Clock& clock;

  /// Called before each pass, with the motor off; not before the first pass of a new session,
  /// since who starts a scan has placed the specimen. Returns when a person has confirmed, or an
  /// error (kind cancelled on a stop request) that ends the scan.
  std::function<Result<void>(const PlacementRequest&, std::stop_token)> ask_for_placement;

  /// How files get onto the disk. Tests make it fail.
  std::function<Result<void>(const std::filesystem::path&, std::string_view)> write_file =
      write_file_durably;
};

struct ScanOptions {
  ScanPlan plan;
  std::string station;
  std::string case_number;
  std::optional<CharucoBoard> board;  ///< lies on the table; absent: there is none
  QualityGates gates;
  /// From the end of a move to the first light of the picture.
  std::chrono::milliseconds settle_time{800};
  /// Between the two frames that the motion gate compares: half a period of a skull that rocks
  /// slowly.
  std::chrono::milliseconds motion_interval{60};
  std::chrono::milliseconds frame_timeout{5000};
  int max_attempts = 3;  ///< per view; then the failing view is recorded as it is

  Result<void> validate() const;
};

struct ScanReport {
  int planned = 0;
  int taken = 0;                      ///< now
  int kept = 0;                       ///< recorded and intact from an interrupted scan
  int retries = 0;                    ///< views taken again because a gate failed
  std::vector<std::string> rejected;  ///< "images/p0_c0_003.png: moved 0.8 px", whole session
  std::vector<std::string> replaced;  ///< recorded images that were damaged or missing
};

/// Photographs the specimen all round and leaves a complete capture session in `folder`.
///
/// Run again with the same options on a session that was interrupted at any moment, it goes on
/// where that one ended: recorded views are verified by their hashes and kept; damaged or missing
/// ones are taken again. A pass whose placement is gone (a later pass has begun, or the session
/// was complete) is taken again as a whole, since all its views must show one placement.
///
/// However it ends, the motor's current and the lights are off and session.json is valid. Errors:
/// usage (options), bad_input (the folder holds something else or a session of another plan; disk
/// full), hardware (turntable, camera after one reopening, emergency stop), cancelled.
/// The lamp and the buzzer are the caller's.
Result<ScanReport> run_scan(const ScanOptions& options, const ScanStation& station,
                            const std::filesystem::path& folder, const Progress& progress);

}  // namespace skullstation
