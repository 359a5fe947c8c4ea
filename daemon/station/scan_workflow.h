#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

#include "capture/scan/scan_session.h"
#include "core/progress.h"
#include "core/result.h"
#include "daemon/station/station.h"
#include "daemon/station/station_config.h"

namespace skullstation {

/// How the person at the station is addressed.
struct OperatorPrompts {
  /// Says on a screen what lamp and buzzer can't: "turn the specimen over, then press the button".
  std::function<void(std::string_view)> tell = [](std::string_view) {};
};

/// One scan from button to complete session: lights its lamp, asks for the specimen to be turned
/// over (a simulated operator does it at once) and runs capture/scan. Resumes an unfinished
/// session. A simulated station leaves simulation_truth.json beside session.json.
Result<ScanReport> scan_specimen(const StationConfig& config, Station& station,
                                 const std::string& case_number,
                                 const std::filesystem::path& session,
                                 const OperatorPrompts& prompts, const Progress& progress);

/// How a scan asks for the specimen to be laid down (ScanStation::ask_for_placement).
using AskForPlacement = std::function<Result<void>(const PlacementRequest&, std::stop_token)>;

/// The scan alone: lamp, buzzer and prompts are the caller's. In a simulated room the specimen is
/// laid down, as a person would, when `ask` has returned.
Result<ScanReport> photograph_specimen(const StationConfig& config, Station& station,
                                       const std::string& case_number,
                                       const std::filesystem::path& session,
                                       const AskForPlacement& ask, const Progress& progress);

/// "Lay the specimen upside down on the board, then press the button."
std::string placement_prompt(const PlacementRequest& request);

/// What a scan of this configuration may take on the disk at most [bytes].
std::uint64_t scan_space_bytes(const StationConfig& config);

/// Waits until the operator has confirmed at the button: brief press goes on, held press cancels.
Result<void> wait_for_confirmation(StationHardware& hardware, const std::stop_token& stop);

}  // namespace skullstation
