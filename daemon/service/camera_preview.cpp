#include "daemon/service/camera_preview.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>

#include "capture/scan/image_quality.h"
#include "core/session/image_file.h"

namespace skullstation {

using namespace std::chrono_literals;

Image8 shrunk(const Image8& image, int most_px) {
  const int block = (image.width + most_px - 1) / most_px;
  if (block <= 1) return image;
  Image8 small(image.width / block, image.height / block, image.channels);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < small.channels; ++c) {
        int sum = 0;
        for (int dy = 0; dy < block; ++dy) {
          for (int dx = 0; dx < block; ++dx) sum += image.at(block * x + dx, block * y + dy, c);
        }
        small.at(x, y, c) = static_cast<std::uint8_t>(sum / (block * block));
      }
    }
  }
  return small;
}

Result<CameraPreview> CameraPreviews::look(const std::string& id, const Station* station,
                                           const StationConfig& config, std::mutex& cameras,
                                           const Clock& clock) {
  constexpr int width_px = 800;
  constexpr int jpeg_quality = 80;
  const std::string where = fmt::format("camera \"{}\"", id);
  if (std::ranges::none_of(config.cameras, [&](const auto& camera) { return camera.id == id; })) {
    return fail(ErrorKind::usage, where, "there is no such camera");
  }
  const std::unique_lock looking(looking_, std::try_to_lock);
  const std::unique_lock free(cameras, std::try_to_lock);
  {
    const std::lock_guard lock(mutex_);
    const auto last = last_.find(id);
    const bool fresh = last != last_.end() && clock.now() - last->second.at < 1s;
    if (last != last_.end() && (fresh || !looking || !free)) return last->second.preview;
  }
  if (station == nullptr) return fail(ErrorKind::hardware, where, "is not open yet");
  if (!looking || !free) return fail(ErrorKind::hardware, where, "is at work");
  const auto found = std::ranges::find(
      station->cameras, id, [](const StationCamera& camera) { return camera.config.id; });
  if (found == station->cameras.end()) return fail(ErrorKind::hardware, where, "is not open");
  const auto frame =
      found->camera->frame_after(station->clock->now(), config.scan.frame_timeout, {});
  if (!frame) return forward(frame);
  const std::optional<CharucoBoard> board =
      config.has_board ? std::optional(config.board) : std::nullopt;
  CameraPreview preview;
  preview.quality = measure_view(frame->image, nullptr, board);
  preview.complaint = failed_gate(preview.quality, config.gates, {}, config.has_board);
  preview.jpeg = encode_jpeg(shrunk(frame->image, width_px), jpeg_quality);
  preview.taken = to_iso8601(clock.utc_now());
  const std::lock_guard lock(mutex_);
  last_[id] = {preview, clock.now()};
  return preview;
}

}  // namespace skullstation
