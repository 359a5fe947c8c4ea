#include "capture/cameras/v4l2_camera.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "capture/cameras/camera_settings.h"
#include "capture/cameras/discarded_frames.h"
#include "capture/cameras/exposure_time.h"
#include "capture/cameras/v4l2_controls.h"
#include "capture/cameras/v4l2_stream.h"

namespace skullstation {
namespace {

using std::chrono::milliseconds;
using std::chrono::nanoseconds;

/// A timestamp further ahead than this does not come from CLOCK_MONOTONIC.
constexpr std::chrono::seconds kMostAhead{1};

std::string stream_text(const V4l2StreamFormat& format) {
  std::string text =
      fmt::format("{} {}x{}", fourcc_name(format.fourcc), format.image.width, format.image.height);
  if (format.image.pixels.layout != PixelLayout::jpeg) {
    text += fmt::format(" stride {}", format.image.stride_bytes);
  }
  if (format.frame_interval && format.frame_interval->count() > 0) {
    text += fmt::format(" {:.4g} fps", 1e9 / static_cast<double>(format.frame_interval->count()));
  }
  return text;
}

/// Everything that exists while the device is open. Destroyed from the bottom up.
struct OpenCamera {
  std::unique_ptr<V4l2Device> device;
  V4l2StreamFormat format;
  V4l2Stream stream;
};

class V4l2Camera final : public Camera {
 public:
  V4l2Camera(V4l2CameraConfig config, std::shared_ptr<V4l2System> system)
      : config_(std::move(config)), system_(std::move(system)) {}

  /// `device`: as in the configuration or, from the second time on, the stable path.
  Result<void> open(const std::string& device_path);

  CameraDescription description() const override { return description_; }
  Result<Frame> frame_after(Instant not_before, milliseconds timeout,
                            std::stop_token stop) override;
  Result<std::vector<CameraControl>> controls() override;
  Result<std::vector<LockedSetting>> lock(const CameraSettings& settings) override;
  Result<void> reopen() override;

 private:
  Result<std::optional<Frame>> frame_from(const V4l2Buffer& buffer, Instant not_before,
                                          DiscardedFrames& discarded);
  Result<std::optional<Instant>> exposure_start(const V4l2Buffer& buffer);
  void settle();
  tl::unexpected<Error> closed() const;

  V4l2CameraConfig config_;
  std::shared_ptr<V4l2System> system_;
  std::unique_ptr<OpenCamera> open_;
  CameraDescription description_;
  CameraSettings locked_;  // everything locked so far
  std::optional<std::chrono::microseconds> exposure_;
  FrameInterval interval_;
  Instant settings_in_force_;        // frames exposed before this moment show older settings
  int frames_to_settle_ = 0;         // and so may this many after it
  std::uint32_t sequence_base_ = 0;  // so that sequence numbers go on after a reopening
  std::uint32_t last_sequence_ = 0;
};

Result<void> V4l2Camera::open(const std::string& device_path) {
  const Result<std::string> node = find_node(system_, device_path);
  if (!node) return forward(node);
  auto device = V4l2Device::open(system_, *node);
  if (!device) return forward(device);
  if (!description_.model.empty() && device->model() != description_.model) {
    return fail(ErrorKind::hardware, device_path,
                fmt::format("is now a {}, it was a {}", device->model(), description_.model),
                "plug the station's own camera in again");
  }
  auto held = std::make_unique<V4l2Device>(std::move(*device));
  auto format = negotiate_format(*held, config_.format);
  if (!format) return forward(format);
  auto stream = V4l2Stream::start(*held, config_.buffers);
  if (!stream) return forward(stream);

  description_.backend = "v4l2";
  description_.model = held->model();
  description_.serial = serial_of(*system_, *node);
  description_.format = stream_text(*format);
  if (description_.stable_path.empty()) {
    const bool is_node = device_path == *node;
    description_.stable_path = is_node ? stable_path_of(system_, *held) : device_path;
  }
  exposure_ = manual_exposure(*held);
  interval_ = FrameInterval(format->frame_interval);
  open_ = std::make_unique<OpenCamera>(OpenCamera{std::move(held), *format, std::move(*stream)});
  settle();
  return {};
}

void V4l2Camera::settle() {
  settings_in_force_ = system_->now();
  frames_to_settle_ = config_.settle_frames;
}

tl::unexpected<Error> V4l2Camera::closed() const {
  return fail(ErrorKind::hardware, description_.stable_path, "the camera is closed", "reopen it");
}

Result<Frame> V4l2Camera::frame_after(Instant not_before, milliseconds timeout,
                                      std::stop_token stop) {
  if (!open_) return closed();
  const Instant deadline = system_->now() + timeout;
  DiscardedFrames discarded;
  do {
    const auto buffer = open_->stream.next(deadline, stop);
    if (!buffer) return forward(buffer);
    if (!*buffer) break;
    Result<std::optional<Frame>> frame = frame_from(**buffer, not_before, discarded);
    if (auto returned = open_->stream.give_back(**buffer); !returned) return forward(returned);
    if (!frame) return forward(frame);
    if (*frame) return std::move(**frame);
  } while (system_->now() < deadline);
  return fail(ErrorKind::hardware, open_->device->node(),
              fmt::format("no good picture within {} ({})", timeout, discarded.text()),
              discarded.damaged > 0 ? "check cable and hub" : "reopen the camera");
}

/// Nothing if the picture is not one to use; `discarded` then says why.
Result<std::optional<Frame>> V4l2Camera::frame_from(const V4l2Buffer& buffer, Instant not_before,
                                                    DiscardedFrames& discarded) {
  const Result<std::optional<Instant>> start = exposure_start(buffer);
  if (!start) return forward(start);
  if (buffer.damaged) {
    ++discarded.damaged;
    discarded.last_damage = "flagged by the driver";
    return std::nullopt;
  }
  if (!*start || **start < settings_in_force_) {
    ++discarded.old;
    return std::nullopt;
  }
  if (frames_to_settle_ > 0) {
    --frames_to_settle_;
    ++discarded.settling;
    return std::nullopt;
  }
  if (**start < not_before) {
    ++discarded.old;
    return std::nullopt;
  }
  Result<Image8> image = decode_image(open_->format.image, buffer.bytes);
  if (!image) {
    ++discarded.damaged;
    discarded.last_damage = fmt::format("{} {}", image.error().where, image.error().what);
    return std::nullopt;
  }
  last_sequence_ = sequence_base_ + buffer.sequence;
  return Frame{std::move(*image), **start, last_sequence_, exposure_};
}

/// The earliest moment of this buffer's exposure; nothing while the frame interval that it takes
/// to know is unknown. Error (kind hardware): the timestamp can't be right.
Result<std::optional<Instant>> V4l2Camera::exposure_start(const V4l2Buffer& buffer) {
  const Instant now = system_->now();
  if (buffer.timestamp > now + kMostAhead) {
    return fail(ErrorKind::hardware, open_->device->node(),
                "its timestamps do not follow the monotonic clock, so an old picture could not be "
                "told from a new one",
                "with uvcvideo, load the module with clock=CLOCK_MONOTONIC");
  }
  interval_.note(buffer.timestamp, buffer.sequence);
  const Instant stamped = std::min(buffer.timestamp, now);
  // uvcvideo claims the start of exposure and stamps the arrival of the first packet.
  if (buffer.exposure_start_stamped && open_->device->driver() != "uvcvideo") {
    return earliest_exposure_start(stamped, TimestampSource::exposure_start, {}, {});
  }
  const std::optional<nanoseconds> interval = interval_.value();
  if (!interval) return std::nullopt;
  return earliest_exposure_start(stamped, TimestampSource::readout, *interval, exposure_);
}

Result<std::vector<CameraControl>> V4l2Camera::controls() {
  if (!open_) return closed();
  return list_v4l2_controls(*open_->device);
}

Result<std::vector<LockedSetting>> V4l2Camera::lock(const CameraSettings& settings) {
  if (!open_) return closed();
  if (auto sensible = check_settings(settings); !sensible) return forward(sensible);
  auto locked = lock_v4l2_controls(*open_->device, settings, config_.gain_steps_per_unit);
  exposure_ = manual_exposure(*open_->device);
  settle();
  if (locked) locked_ = overlaid(locked_, settings);
  return locked;
}

Result<void> V4l2Camera::reopen() {
  open_.reset();
  sequence_base_ = last_sequence_ + 1;
  if (auto opened = open(description_.stable_path); !opened) return opened;
  if (auto locked = lock(locked_); !locked) {
    open_.reset();
    return forward(locked);
  }
  return {};
}

}  // namespace

Result<void> V4l2CameraConfig::validate() const {
  const auto refuse = [](std::string where, std::string what) -> Result<void> {
    return fail(ErrorKind::bad_input, std::move(where), std::move(what));
  };
  if (device.empty()) return refuse("device", "is empty");
  if (buffers < 2 || buffers > 32) {
    return refuse("buffers", fmt::format("is {}, expected 2 to 32", buffers));
  }
  if (settle_frames < 0) {
    return refuse("settle_frames", fmt::format("is {}, expected 0 or more", settle_frames));
  }
  if (format.size && (format.size->width <= 0 || format.size->height <= 0)) {
    return refuse(
        "size", fmt::format("is {}x{}, expected pixels", format.size->width, format.size->height));
  }
  if (format.frames_per_second &&
      !(*format.frames_per_second > 0.0 && *format.frames_per_second <= 1000.0)) {
    return refuse("frames_per_second",
                  fmt::format("is {}, expected up to 1000", *format.frames_per_second));
  }
  if (gain_steps_per_unit && !(*gain_steps_per_unit > 0.0)) {
    return refuse("gain_steps_per_unit",
                  fmt::format("is {}, expected more than 0", *gain_steps_per_unit));
  }
  return {};
}

Result<std::unique_ptr<Camera>> open_v4l2_camera(const V4l2CameraConfig& config,
                                                 std::shared_ptr<V4l2System> system) {
  if (auto valid = config.validate(); !valid) return forward(valid);
  auto camera = std::make_unique<V4l2Camera>(config, std::move(system));
  if (auto opened = camera->open(config.device); !opened) return forward(opened);
  return camera;
}

Result<std::unique_ptr<Camera>> open_v4l2_camera(const V4l2CameraConfig& config) {
  return open_v4l2_camera(config, kernel_v4l2_system());
}

}  // namespace skullstation
