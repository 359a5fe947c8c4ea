#include "daemon/station/scan_workflow.h"

#include <fmt/format.h>

namespace skullstation {

using namespace std::chrono_literals;

namespace {

ScanPlan plan_of(const StationConfig& config) {
  ScanPlan plan;
  for (const CameraConfig& camera : config.cameras) {
    plan.rings.push_back({camera.id, config.scan.views_per_ring});
  }
  plan.passes = config.scan.passes;
  plan.image_format = config.scan.image_format;
  plan.jpeg_quality = config.scan.jpeg_quality;
  return plan;
}

ScanOptions options_of(const StationConfig& config, const std::string& case_number) {
  ScanOptions options;
  options.plan = plan_of(config);
  options.station = config.station_id;
  options.case_number = case_number;
  if (config.has_board) options.board = config.board;
  options.gates = config.gates;
  options.settle_time = config.scan.settle_time;
  options.frame_timeout = config.scan.frame_timeout;
  options.max_attempts = config.scan.max_attempts;
  return options;
}

std::string_view placement_words(int pass) {
  switch (pass) {
    case 0: return "upright";
    case 1: return "upside down";
    default: return "on its back, face up";
  }
}

/// Every picture that reaches the disk gets its truth noted and written before session.json names
/// the picture, so that an interrupted scan has it too.
void note_truths(SimulatedRoom& room, const ScanPlan& plan, const std::filesystem::path& session,
                 ScanStation& scan) {
  std::map<std::string, int> pass_of;
  for (const PlannedView& view : planned_views(plan)) pass_of[view.image] = view.pass;
  scan.write_file = [&room, pass_of, session](const std::filesystem::path& path,
                                              std::string_view bytes) -> Result<void> {
    if (auto written = write_file_durably(path, bytes); !written) return written;
    const auto image = pass_of.find(path.lexically_relative(session).generic_string());
    if (image == pass_of.end()) return {};
    room.note_truth(image->first, image->second);
    return room.write_truth(session / "simulation_truth.json");
  };
}

}  // namespace

Result<void> wait_for_confirmation(StationHardware& hardware, const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto press = hardware.button->wait_for_press(1s, stop);
    if (!press) return forward(press);
    if (!*press) continue;
    if (**press == Press::brief) return {};
    return fail(ErrorKind::cancelled, "", "cancelled at the button");
  }
  return fail(ErrorKind::cancelled, "", "cancelled");
}

std::string placement_prompt(const PlacementRequest& request) {
  if (request.continued) {
    return fmt::format(
        "The scan goes on: the specimen must lie {} exactly as it did. Press the button.",
        placement_words(request.pass));
  }
  return fmt::format("Lay the specimen {} on the board, then press the button.",
                     placement_words(request.pass));
}

std::uint64_t scan_space_bytes(const StationConfig& config) {
  std::uint64_t bytes = 0;
  for (const CameraConfig& camera : config.cameras) {
    const auto pixels =
        static_cast<std::uint64_t>(camera.width) * static_cast<std::uint64_t>(camera.height);
    bytes += static_cast<std::uint64_t>(config.scan.views_per_ring * config.scan.passes) *
             (3 * pixels + pixels / 10);
  }
  return bytes;
}

Result<ScanReport> photograph_specimen(const StationConfig& config, Station& station,
                                       const std::string& case_number,
                                       const std::filesystem::path& session,
                                       const AskForPlacement& ask, const Progress& progress) {
  const ScanOptions options = options_of(config, case_number);
  ScanStation scan{station.hardware, station.scan_cameras(), *station.clock, ask};
  if (station.room) {
    note_truths(*station.room, options.plan, session, scan);
    station.room->place_specimen(0);
    scan.ask_for_placement = [&](const PlacementRequest& request, std::stop_token stop) {
      auto confirmed = ask(request, std::move(stop));
      if (confirmed) station.room->place_specimen(request.pass);
      return confirmed;
    };
  }
  return run_scan(options, scan, session, progress);
}

Result<ScanReport> scan_specimen(const StationConfig& config, Station& station,
                                 const std::string& case_number,
                                 const std::filesystem::path& session,
                                 const OperatorPrompts& prompts, const Progress& progress) {
  StationHardware& hardware = station.hardware;
  AskForPlacement ask = [](const PlacementRequest&, const std::stop_token&) -> Result<void> {
    return {};
  };
  if (!station.room) {
    ask = [&](const PlacementRequest& request, const std::stop_token& stop) -> Result<void> {
      prompts.tell(placement_prompt(request));
      if (auto shown = hardware.lamp->show(Signal::attention); !shown) return shown;
      if (auto confirmed = wait_for_confirmation(hardware, stop); !confirmed) {
        return confirmed;
      }
      return hardware.lamp->show(Signal::working);
    };
  }

  if (const auto shown = hardware.lamp->show(Signal::working); !shown) return forward(shown);
  auto report = photograph_specimen(config, station, case_number, session, ask, progress);
  const bool stopped_by_hand = !report && report.error().kind == ErrorKind::cancelled;
  const Signal outcome = report ? Signal::done : stopped_by_hand ? Signal::ready : Signal::fault;
  // A lamp that fails now must not hide the scan's own outcome.
  static_cast<void>(hardware.lamp->show(outcome));
  return report;
}

}  // namespace skullstation
