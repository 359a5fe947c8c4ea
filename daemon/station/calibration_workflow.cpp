#include "daemon/station/calibration_workflow.h"

#include <fmt/format.h>

#include <filesystem>

#include "capture/calibration/calibration_file.h"
#include "core/file.h"
#include "daemon/station/station.h"

namespace skullstation {

void BoardPictures::add(std::string name, const Image8& image, const CharucoBoard& board) {
  width = image.width;
  height = image.height;
  views.push_back({std::move(name), detect_board(image, board)});
}

Result<BoardPictures> photograph_board(StationConfig config, const std::string& camera_id,
                                       const OperatorPrompts& prompts, std::uint64_t seed,
                                       int threads, const Progress& progress) {
  std::erase_if(config.cameras, [&](const CameraConfig& c) { return c.id != camera_id; });
  config.calibration_folder.clear();
  auto station = open_station(config, RoomSetting::board_in_hand, seed, threads);
  if (!station) return forward(station);
  StationCamera& camera = station->cameras.front();
  const auto poses =
      calibration_poses(simulated_lens(camera.config), camera.config.simulated.distance_mm);
  BoardPictures pictures;
  pictures.device = device_name(*camera.camera);
  pictures.taken = station->clock->utc_now();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string name = fmt::format("view {} of {}", i + 1, poses.size());
    progress.report(static_cast<double>(i) / static_cast<double>(poses.size()), name);
    if (station->room) {
      station->room->hold_board(camera.config, poses[i]);
    } else {
      prompts.tell(
          fmt::format("{}: hold the board aslant, in another direction and part of the picture "
                      "each time, near and far in turn; then press the button.",
                      name));
      if (const auto ready = wait_for_confirmation(station->hardware, progress.stop); !ready) {
        return forward(ready);
      }
    }
    const auto frame =
        camera.camera->frame_after(station->clock->now(), config.scan.frame_timeout, progress.stop);
    if (!frame) return forward(frame);
    pictures.add(name, frame->image, config.board);
  }
  return pictures;
}

Result<CameraCalibrationReport> calibrate_from(const BoardPictures& pictures,
                                               const CharucoBoard& board,
                                               const std::string& camera_id) {
  auto report = calibrate_camera(pictures.views, board, pictures.width, pictures.height);
  if (!report) return report;
  report->calibration.camera = camera_id;
  report->calibration.device = pictures.device;
  report->calibration.created = to_iso8601(pictures.taken);
  return report;
}

Result<void> calibrate_lenses(const StationConfig& config, std::uint64_t seed, int threads,
                              const Progress& progress) {
  const auto count = static_cast<double>(config.cameras.size());
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    const std::string& id = config.cameras[i].id;
    const auto file = camera_calibration_file(config, id);
    if (std::filesystem::exists(file)) continue;
    const double done = static_cast<double>(i) / count;
    const auto pictures =
        photograph_board(config, id, {}, seed, threads, progress.part(done, done + 1.0 / count));
    if (!pictures) return forward(pictures);
    const auto report = calibrate_from(*pictures, config.board, id);
    if (!report) return forward(report);
    if (auto ready = make_writable_folder(file.parent_path()); !ready) return ready;
    if (auto written = write_camera_calibration(report->calibration, file); !written) {
      return written;
    }
  }
  return {};
}

}  // namespace skullstation
