#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "capture/calibration/calibration_file.h"
#include "capture/calibration/table_calibration.h"
#include "capture/cameras/replay_camera.h"
#include "core/session/image_file.h"
#include "daemon/cli/commands.h"
#include "daemon/station/calibration_workflow.h"
#include "daemon/station/station.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

// ------------------------------------------------------------------------------------- camera --

Result<BoardPictures> read_pictures(const std::filesystem::path& folder, const CharucoBoard& board,
                                    const Progress& progress) {
  const auto files = pictures_in(folder);
  if (!files) return forward(files);
  BoardPictures pictures;
  pictures.device = "photographs in " + folder.string();
  pictures.taken = SystemClock().utc_now();
  for (std::size_t i = 0; i < files->size(); ++i) {
    const std::filesystem::path& file = (*files)[i];
    progress.report(static_cast<double>(i) / static_cast<double>(files->size()),
                    "reading " + file.filename().string());
    const auto image = read_image(file);
    if (!image) return forward(image);
    if (i > 0 && (image->width != pictures.width || image->height != pictures.height)) {
      return fail(ErrorKind::bad_input, file.string(),
                  fmt::format("is {}x{} pixels, the pictures before it are {}x{}", image->width,
                              image->height, pictures.width, pictures.height),
                  "give photographs of one camera with one setting");
    }
    pictures.add(file.filename().string(), *image, board);
  }
  return pictures;
}

Result<std::string> chosen_camera(const StationConfig& config, const std::string& id) {
  if (id.empty() && config.cameras.size() == 1) return config.cameras.front().id;
  std::vector<std::string> known;
  for (const CameraConfig& camera : config.cameras) {
    if (camera.id == id) return id;
    known.push_back(camera.id);
  }
  return fail(ErrorKind::usage, "--camera",
              id.empty() ? "must say which camera" : fmt::format("there is no \"{}\"", id),
              fmt::format("use one of: {}", fmt::join(known, ", ")));
}

Result<BoardPictures> pictures_for(const CalibrateCameraCommand& command,
                                   const StationConfig& config, const std::string& id,
                                   const CommonOptions& common, const Progress& progress) {
  if (!command.images.empty()) return read_pictures(command.images, config.board, progress);
  OperatorPrompts prompts;
  prompts.tell = [](std::string_view words) { fmt::print(stderr, "\n{}\n", words); };
  return photograph_board(config, id, prompts, common.seed, common.threads, progress);
}

CommandReport camera_report(const CameraCalibrationReport& report,
                            const std::filesystem::path& file) {
  const CameraCalibration& calibration = report.calibration;
  std::string text =
      fmt::format("camera {}: {} views, {} corners, RMS {:.3f} px, {:.0f} % of the image covered\n",
                  calibration.camera, calibration.views, calibration.corners, calibration.rms_px,
                  100.0 * report.coverage);
  const std::vector<double> params = calibration.lens.params(LensModel::opencv);
  constexpr std::array<const char*, 8> names{"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    text += fmt::format("  {} {:12.5f} +- {:.5f}\n", names[i], params[i],
                        calibration.standard_errors[i]);
  }
  auto left_out = nlohmann::ordered_json::array();
  for (const CalibrationViewReport& view : report.views) {
    if (view.left_out.empty()) continue;
    text += fmt::format("  left out: {}: {}\n", view.name, view.left_out);
    left_out.push_back({{"view", view.name}, {"why", view.left_out}});
  }
  text += "written to " + file.string();
  const nlohmann::ordered_json json = {{"camera", calibration.camera},
                                       {"file", file.string()},
                                       {"views", calibration.views},
                                       {"corners", calibration.corners},
                                       {"rms_px", calibration.rms_px},
                                       {"coverage", report.coverage},
                                       {"params", params},
                                       {"standard_errors", calibration.standard_errors},
                                       {"left_out", left_out}};
  return {text, json.dump(2)};
}

/// Makes the folder of a calibration file on its first use.
Result<void> prepare_folder(const std::filesystem::path& file) {
  return file.has_parent_path() ? make_writable_folder(file.parent_path()) : Result<void>{};
}

// -------------------------------------------------------------------------------------- table --

Result<std::vector<TableCamera>> calibrated_cameras(const Station& station) {
  std::vector<TableCamera> cameras;
  for (const StationCamera& camera : station.cameras) {
    if (!camera.calibration) {
      return fail(
          ErrorKind::bad_input, fmt::format("camera \"{}\"", camera.config.id),
          "is not calibrated yet",
          fmt::format("run `skullstation calibrate camera --camera {}` first", camera.config.id));
    }
    cameras.push_back({camera.config.id, camera.calibration->lens});
  }
  return cameras;
}

Result<std::vector<TableView>> observe_table(const StationConfig& config, Station& station,
                                             int stops, const Progress& progress) {
  Turntable& table = *station.hardware.turntable;
  std::vector<TableView> views;
  for (int stop = 0; stop < stops; ++stop) {
    const double angle_deg = 360.0 * stop / stops;
    const std::string stage = fmt::format("stop {} of {}", stop + 1, stops);
    progress.report(static_cast<double>(stop) / stops, stage);
    if (const auto moved = table.move_to(angle_deg, progress.stop); !moved) return forward(moved);
    const Instant settled = station.clock->now() + config.scan.settle_time;
    for (StationCamera& camera : station.cameras) {
      const auto frame =
          camera.camera->frame_after(settled, config.scan.frame_timeout, progress.stop);
      if (!frame) return forward(frame);
      views.push_back({fmt::format("{} at {:g} deg", camera.config.id, angle_deg), camera.config.id,
                       stop, table.angle_deg().value_or(angle_deg),
                       detect_board(frame->image, config.board)});
    }
  }
  return views;
}

/// Moves, looks, and leaves the station dark and without motor current however it ends.
Result<std::vector<TableView>> turn_and_observe(const StationConfig& config, Station& station,
                                                int stops, const Progress& progress) {
  StationHardware& hardware = station.hardware;
  if (const auto lit = hardware.lights->set(true); !lit) return forward(lit);
  Result<std::vector<TableView>> views;
  if (const auto homed = hardware.turntable->home(progress.stop); homed) {
    views = observe_table(config, station, stops, progress);
  } else {
    views = forward(homed);
  }
  const auto released = hardware.turntable->release();
  const auto dark = hardware.lights->set(false);
  if (views && !released) return forward(released);
  if (views && !dark) return forward(dark);
  return views;
}

CommandReport table_report(const TableCalibrationReport& report,
                           const std::filesystem::path& file) {
  const TableCalibration& table = report.calibration;
  const nlohmann::ordered_json json = {{"file", file.string()},
                                       {"stops", report.stops.size()},
                                       {"rms_px", report.rms_px},
                                       {"turn_ratio", table.turn_ratio},
                                       {"angle_rms_deg", table.angle_rms_deg},
                                       {"wobble_mm", table.wobble_mm},
                                       {"axis_error_deg", table.axis_error_deg},
                                       {"axis_error_mm", table.axis_error_mm}};
  return {fmt::format("table: {} stops, RMS {:.3f} px\n"
                      "  turns {:.5f} of what is commanded, angles {:.4f} deg RMS\n"
                      "  wobble at the board's rim {:.3f} mm\n"
                      "  axis known to {:.4f} deg and {:.4f} mm\nwritten to {}",
                      report.stops.size(), report.rms_px, table.turn_ratio, table.angle_rms_deg,
                      table.wobble_mm, table.axis_error_deg, table.axis_error_mm, file.string()),
          json.dump(2)};
}

}  // namespace

Result<CommandReport> run(const CalibrateCameraCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const auto id = chosen_camera(*config, command.camera);
  if (!id) return forward(id);
  const auto pictures = pictures_for(command, *config, *id, common, progress.part(0.0, 0.9));
  if (!pictures) return forward(pictures);
  progress.report(0.9, "fitting the lens");
  const auto report = calibrate_from(*pictures, config->board, *id);
  if (!report) return forward(report);
  const auto file = command.out.empty() ? camera_calibration_file(*config, *id) : command.out;
  if (const auto ready = prepare_folder(file); !ready) return forward(ready);
  if (const auto written = write_camera_calibration(report->calibration, file); !written) {
    return forward(written);
  }
  return camera_report(*report, file);
}

Result<CommandReport> run(const CalibrateTableCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  if (!config->has_board) {
    return fail(ErrorKind::bad_input, "board.present",
                "is false: the table is measured by its board",
                "lay the board on the table and set it to true");
  }
  auto station = open_station(*config, RoomSetting::bare_table, common.seed, common.threads);
  if (!station) return forward(station);
  const auto cameras = calibrated_cameras(*station);
  if (!cameras) return forward(cameras);
  const auto views = turn_and_observe(*config, *station, command.stops, progress.part(0.0, 0.95));
  if (!views) return forward(views);
  progress.report(0.95, "fitting the axis");
  auto report = calibrate_table(*views, *cameras, config->board);
  if (!report) return forward(report);
  const auto file = command.out.empty() ? table_calibration_file(*config) : command.out;
  if (!report->verdicts.empty()) {
    return fail(ErrorKind::no_result, "turntable",
                fmt::format("{}", fmt::join(report->verdicts, "; ")),
                "nothing was written; mend it and calibrate again");
  }
  report->calibration.created = to_iso8601(station->clock->utc_now());
  if (const auto ready = prepare_folder(file); !ready) return forward(ready);
  if (const auto written = write_table_calibration(report->calibration, file); !written) {
    return forward(written);
  }
  return table_report(*report, file);
}

}  // namespace skullstation
