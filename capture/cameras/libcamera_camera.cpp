#include "capture/cameras/libcamera_camera.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <libcamera/camera_manager.h>
#include <libcamera/control_ids.h>
#include <libcamera/property_ids.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <mutex>
#include <utility>

#include "capture/cameras/camera_settings.h"
#include "capture/cameras/discarded_frames.h"
#include "capture/cameras/exposure_time.h"
#include "capture/cameras/libcamera_controls.h"
#include "capture/cameras/libcamera_stream.h"

namespace skullstation {
namespace {

using std::chrono::microseconds;
using std::chrono::milliseconds;
using std::chrono::nanoseconds;
using CameraManager = libcamera::CameraManager;

/// How long lock() waits for the first frames made with the new settings.
constexpr std::chrono::seconds kLockTimeout{5};

/// libcamera allows one manager in a process; all cameras share it while any is open.
Result<std::shared_ptr<CameraManager>> shared_manager() {
  static std::mutex mutex;
  static std::weak_ptr<CameraManager> running;
  const std::scoped_lock lock(mutex);
  if (auto manager = running.lock()) return manager;
  auto manager = std::make_unique<CameraManager>();
  if (const int outcome = manager->start(); outcome < 0) {
    return fail(ErrorKind::hardware, "libcamera",
                fmt::format("can't be started: {}", std::strerror(-outcome)));
  }
  std::shared_ptr<CameraManager> started(manager.release(), [](CameraManager* stopping) {
    stopping->stop();
    delete stopping;
  });
  running = started;
  return started;
}

std::string model_of(const libcamera::Camera& camera) {
  return camera.properties().get(libcamera::properties::Model).value_or("");
}

Result<std::shared_ptr<libcamera::Camera>> find_camera(CameraManager& manager,
                                                       const std::string& id) {
  const auto cameras = manager.cameras();
  std::string there;
  for (const auto& camera : cameras) {
    if (camera->id() == id) return camera;
    there += fmt::format("{}{}", there.empty() ? "" : ", ", camera->id());
  }
  if (cameras.empty()) {
    return fail(ErrorKind::hardware, "libcamera", "no camera found",
                "check the ribbon cable and that the system's camera driver is enabled");
  }
  if (id.empty() && cameras.size() == 1) return cameras.front();
  return fail(id.empty() ? ErrorKind::bad_input : ErrorKind::hardware, "libcamera",
              id.empty() ? std::string("there are several cameras and none was named")
                         : fmt::format("there is no camera \"{}\"", id),
              fmt::format("choose from: {}", there));
}

/// How much later CLOCK_BOOTTIME is than CLOCK_MONOTONIC: the time that the machine slept.
nanoseconds time_asleep() {
  const auto read = [](clockid_t clock) {
    timespec time{};
    ::clock_gettime(clock, &time);
    return std::chrono::seconds{time.tv_sec} + nanoseconds{time.tv_nsec};
  };
  const nanoseconds monotonic = read(CLOCK_MONOTONIC);
  return std::max(nanoseconds{0}, read(CLOCK_BOOTTIME) - monotonic);
}

class LibcameraCamera final : public Camera {
 public:
  LibcameraCamera(LibcameraConfig config, std::shared_ptr<CameraManager> manager)
      : config_(std::move(config)), manager_(std::move(manager)) {}

  Result<void> open();

  CameraDescription description() const override { return description_; }
  Result<Frame> frame_after(Instant not_before, milliseconds timeout,
                            std::stop_token stop) override;
  Result<std::vector<CameraControl>> controls() override;
  Result<std::vector<LockedSetting>> lock(const CameraSettings& settings) override;
  Result<void> reopen() override;

 private:
  Result<void> start(const libcamera::ControlList& controls);
  Result<std::vector<LockedSetting>> wait_for_settings(const libcamera::ControlList& asked);
  std::optional<Frame> frame_from(libcamera::Request& request, Instant not_before,
                                  DiscardedFrames& discarded);
  std::optional<Instant> exposure_start(const libcamera::Request& request);
  bool settings_in_use(const libcamera::ControlList& metadata) const;
  tl::unexpected<Error> closed() const;

  LibcameraConfig config_;
  std::shared_ptr<CameraManager> manager_;
  std::unique_ptr<LibcameraStream> stream_;
  CameraDescription description_;
  CameraSettings locked_;                        // everything locked so far
  std::optional<microseconds> exposure_locked_;  // as the camera reported it
  libcamera::ControlList last_metadata_;
  FrameInterval interval_;
  Instant started_;
  int frames_to_settle_ = 0;
  std::uint32_t sequence_base_ = 0;  // so that sequence numbers go on after a restart
  std::uint32_t last_sequence_ = 0;
};

Result<void> LibcameraCamera::open() {
  const auto camera = find_camera(*manager_, config_.id);
  if (!camera) return forward(camera);
  auto stream = LibcameraStream::open(*camera, config_);
  if (!stream) return forward(stream);
  stream_ = std::move(*stream);
  config_.id = (*camera)->id();
  const RawImageFormat& format = stream_->format();
  description_ = {.backend = "libcamera",
                  .model = model_of(**camera),
                  .serial = {},
                  .stable_path = config_.id,
                  .format = fmt::format("{} {}x{} stride {}", stream_->format_name(), format.width,
                                        format.height, format.stride_bytes)};
  return {};
}

Result<void> LibcameraCamera::start(const libcamera::ControlList& controls) {
  sequence_base_ = last_sequence_ + 1;
  started_ = std::chrono::steady_clock::now();
  interval_ = FrameInterval();
  exposure_locked_.reset();
  frames_to_settle_ = config_.settle_frames;
  return stream_->start(controls);
}

tl::unexpected<Error> LibcameraCamera::closed() const {
  return fail(ErrorKind::hardware, config_.id, "the camera is closed", "reopen it");
}

Result<Frame> LibcameraCamera::frame_after(Instant not_before, milliseconds timeout,
                                           std::stop_token stop) {
  if (!stream_) return closed();
  const Instant deadline = std::chrono::steady_clock::now() + timeout;
  DiscardedFrames discarded;
  do {
    const Result<libcamera::Request*> request = stream_->next(deadline, stop);
    if (!request) return forward(request);
    if (*request == nullptr) break;
    std::optional<Frame> frame = frame_from(**request, not_before, discarded);
    if (auto returned = stream_->give_back(*request); !returned) return forward(returned);
    if (frame) return std::move(*frame);
  } while (std::chrono::steady_clock::now() < deadline);
  return fail(ErrorKind::hardware, config_.id,
              fmt::format("no good picture within {} ({})", timeout, discarded.text()),
              "reopen the camera; if it happens again, check its cable");
}

std::optional<Frame> LibcameraCamera::frame_from(libcamera::Request& request, Instant not_before,
                                                 DiscardedFrames& discarded) {
  last_metadata_ = request.metadata();
  const libcamera::FrameBuffer& buffer = stream_->buffer_of(request);
  const std::optional<Instant> start = exposure_start(request);
  if (buffer.metadata().status != libcamera::FrameMetadata::FrameSuccess) {
    ++discarded.damaged;
    discarded.last_damage = "flagged by the driver";
    return std::nullopt;
  }
  if (!start || *start < started_) {
    ++discarded.old;
    return std::nullopt;
  }
  if (frames_to_settle_ > 0 || !settings_in_use(last_metadata_)) {
    frames_to_settle_ = std::max(0, frames_to_settle_ - 1);
    ++discarded.settling;
    return std::nullopt;
  }
  if (*start < not_before) {
    ++discarded.old;
    return std::nullopt;
  }
  Result<Image8> image = decode_image(stream_->format(), stream_->read(buffer));
  if (!image) {
    ++discarded.damaged;
    discarded.last_damage = fmt::format("{} {}", image.error().where, image.error().what);
    return std::nullopt;
  }
  last_sequence_ = sequence_base_ + buffer.metadata().sequence;
  return Frame{std::move(*image), *start, last_sequence_, exposure_of(last_metadata_)};
}

/// Nothing while the frame interval that it takes to know is unknown.
std::optional<Instant> LibcameraCamera::exposure_start(const libcamera::Request& request) {
  const libcamera::FrameMetadata& frame = stream_->buffer_of(request).metadata();
  const auto sensor = sensor_timestamp_of(last_metadata_);
  // Drivers stamp the start of readout with CLOCK_MONOTONIC although the control's text says
  // CLOCK_BOOTTIME: take the earlier of the two readings.
  const Instant timestamp{sensor ? *sensor - time_asleep()
                                 : nanoseconds{static_cast<std::int64_t>(frame.timestamp)}};
  interval_.note(timestamp, frame.sequence);
  const auto interval = std::max(interval_.value(), frame_duration_of(last_metadata_));
  if (!interval) return std::nullopt;
  return earliest_exposure_start(std::min(timestamp, Instant{std::chrono::steady_clock::now()}),
                                 TimestampSource::readout, *interval, exposure_of(last_metadata_));
}

/// The sensor counts exposure in lines, so a frame's exposure may differ by one of them.
bool LibcameraCamera::settings_in_use(const libcamera::ControlList& metadata) const {
  if (!exposure_locked_) return true;
  const auto used = exposure_of(metadata);
  const auto tolerance = std::max(microseconds{100}, *exposure_locked_ / 50);
  return used && std::chrono::abs(*used - *exposure_locked_) <= tolerance;
}

Result<std::vector<CameraControl>> LibcameraCamera::controls() {
  if (!stream_) return closed();
  return list_controls(stream_->camera().controls(), last_metadata_);
}

Result<std::vector<LockedSetting>> LibcameraCamera::lock(const CameraSettings& settings) {
  if (!stream_) return closed();
  if (auto sensible = check_settings(settings); !sensible) return forward(sensible);
  const CameraSettings all = overlaid(locked_, settings);
  const auto asked = controls_for(stream_->camera().controls(), all, config_.id);
  if (!asked) return forward(asked);
  if (auto started = start(*asked); !started) return forward(started);
  if (asked->empty()) return std::vector<LockedSetting>{};
  auto locked = wait_for_settings(*asked);
  if (locked) locked_ = all;
  return locked;
}

/// Takes the settling frames and reads from the next one's metadata what is in force.
Result<std::vector<LockedSetting>> LibcameraCamera::wait_for_settings(
    const libcamera::ControlList& asked) {
  const Result<Frame> settled = frame_after(started_, kLockTimeout, {});
  if (!settled) return forward(settled);
  exposure_locked_ = asked.contains(libcamera::controls::ExposureTime.id())
                         ? exposure_of(last_metadata_)
                         : std::nullopt;
  return settings_in_force(asked, last_metadata_, config_.id);
}

Result<void> LibcameraCamera::reopen() {
  stream_.reset();
  if (auto opened = open(); !opened) return opened;
  if (auto locked = lock({}); !locked) {
    stream_.reset();
    return forward(locked);
  }
  return {};
}

}  // namespace

Result<std::vector<LibcameraInfo>> list_libcamera_cameras() {
  const auto manager = shared_manager();
  if (!manager) return forward(manager);
  std::vector<LibcameraInfo> cameras;
  for (const auto& camera : (*manager)->cameras()) {
    cameras.push_back({camera->id(), model_of(*camera)});
  }
  return cameras;
}

Result<std::unique_ptr<Camera>> open_libcamera_camera(const LibcameraConfig& config) {
  if (auto valid = config.validate(); !valid) return forward(valid);
  const auto manager = shared_manager();
  if (!manager) return forward(manager);
  auto camera = std::make_unique<LibcameraCamera>(config, *manager);
  if (auto opened = camera->reopen(); !opened) return forward(opened);
  return camera;
}

}  // namespace skullstation
