#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/cameras/v4l2_format.h"
#include "capture/cameras/v4l2_system.h"
#include "tests/support/temporary_folder.h"

namespace skullstation::testing {

/// A control of a scripted camera. Menus offer the listed entries only.
struct ScriptedControl {
  std::uint32_t id = 0;
  std::string name;
  std::uint32_t type = V4L2_CTRL_TYPE_INTEGER;
  std::int64_t minimum = 0;
  std::int64_t maximum = 0;
  std::int64_t step = 1;
  std::int64_t value = 0;
  std::uint32_t flags = 0;
  std::vector<std::int64_t> menu = {};
  bool stuck = false;  ///< takes no other value, and doesn't say so
  int set_error = 0;   ///< errno of every attempt to set it
  int get_error = 0;
};

/// What goes wrong with one frame.
struct ScriptedFrame {
  bool dropped = false;
  bool damaged = false;                                 ///< V4L2_BUF_FLAG_ERROR
  std::chrono::nanoseconds age{0};                      ///< its timestamp lies that far back
  std::optional<std::vector<std::uint8_t>> bytes = {};  ///< instead of the camera's picture
};

/// One video node. The picture's bytes are `fill` everywhere unless given.
struct ScriptedCamera {
  std::string model = "Scripted Camera";
  std::string driver = "scripted";
  std::string bus = "usb-0000:00:14.0-1";
  std::string serial = "SN1234";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  std::vector<V4l2OfferedFormat> formats;
  std::vector<std::vector<double>> rates = {};  ///< per format [frames/s]; empty: not enumerated
  std::vector<ScriptedControl> controls = {};
  std::chrono::nanoseconds frame_interval = std::chrono::milliseconds(40);
  bool rate_settable = true;
  std::size_t stride_padding = 0;
  std::optional<FrameSize> size_answer = {};        ///< what the driver makes of any size
  std::optional<std::uint32_t> format_answer = {};  ///< and of any format
  std::uint32_t field_answer = V4L2_FIELD_NONE;
  std::uint32_t colorspace = V4L2_COLORSPACE_SRGB;
  std::uint32_t ycbcr_encoding = V4L2_YCBCR_ENC_DEFAULT;
  std::uint32_t timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC | V4L2_BUF_FLAG_TSTAMP_SRC_SOE;
  std::uint32_t most_buffers = 32;
  std::vector<std::uint8_t> picture = {};  ///< empty: `fill` everywhere
  std::uint8_t fill = 128;
  std::deque<ScriptedFrame> script = {};  ///< the next frames; then good ones
  bool all_dropped = false;
  bool hangs_up = false;                                 ///< poll: POLLERR, while DQBUF: EAGAIN
  std::map<unsigned long, std::deque<int>> errors = {};  ///< errno of the next calls per request
  int open_error = 0;
  bool maps = true;
};

/// A kernel with scripted cameras in virtual time. dev/ and sys/ are real folders with real links
/// under a temporary root, as udev would make them.
class ScriptedV4l2 final : public V4l2System {
 public:
  ScriptedV4l2();

  /// Makes dev/videoN with its links in by-id and by-path and its serial number in sys.
  std::string plug_in(std::shared_ptr<ScriptedCamera> camera, int number, bool links = true);
  void unplug(int number);
  std::string node(int number) const;
  std::string by_id() const;
  std::string by_path() const;

  /// Called at the beginning of every wait.
  std::function<void()> on_wait;
  std::vector<unsigned long> calls;  ///< every ioctl so far
  int open_descriptors() const { return static_cast<int>(open_.size()); }
  int mapped_buffers() const { return mapped_; }
  void advance(std::chrono::nanoseconds time) { now_ += time; }

  std::filesystem::path root() const override { return root_.path(); }
  Instant now() const override { return now_; }
  int open(const std::string& node) override;
  void close(int descriptor) override;
  int ioctl(int descriptor, unsigned long request, void* argument) override;
  void* map(int descriptor, std::size_t length, std::int64_t offset) override;
  void unmap(void* address, std::size_t length) override;
  int wait(int descriptor, Instant deadline, std::stop_token stop) override;

 private:
  struct Buffer {
    std::vector<std::uint8_t> memory;
    std::size_t used = 0;
    std::uint32_t flags = 0;
    Instant timestamp;
    std::uint32_t sequence = 0;
  };
  struct Opened {
    std::shared_ptr<ScriptedCamera> camera;
    bool gone = false;
    v4l2_pix_format format{};
    bool streaming = false;
    std::vector<Buffer> buffers;
    std::deque<std::uint32_t> queued;
    std::deque<std::uint32_t> done;
    Instant next_frame;
    std::uint32_t sequence = 0;
  };

  int dispatch(Opened& opened, unsigned long request, void* argument);
  int set_format(Opened& opened, v4l2_format& format) const;
  int list_formats(const ScriptedCamera& camera, v4l2_fmtdesc& entry) const;
  int list_sizes(const ScriptedCamera& camera, v4l2_frmsizeenum& entry) const;
  int list_rates(const ScriptedCamera& camera, v4l2_frmivalenum& entry) const;
  int rate(Opened& opened, v4l2_streamparm& parameters, bool set) const;
  int query_control(const ScriptedCamera& camera, v4l2_query_ext_ctrl& query) const;
  int access_control(ScriptedCamera& camera, v4l2_ext_controls& batch, bool set) const;
  int request_buffers(Opened& opened, v4l2_requestbuffers& request) const;
  int take_buffer(Opened& opened, v4l2_buffer& buffer) const;
  void expose_until(Opened& opened, Instant moment) const;
  void fill(Opened& opened, const ScriptedFrame& frame) const;

  TemporaryFolder root_;
  Instant now_{std::chrono::hours(1)};
  std::map<int, std::shared_ptr<ScriptedCamera>> plugged_;
  std::map<int, Opened> open_;
  int next_descriptor_ = 100;
  int mapped_ = 0;
};

/// A colour camera with YUYV, MJPEG and grey in the usual sizes and all the controls that a scan
/// locks, automatics on: like a good USB webcam.
std::shared_ptr<ScriptedCamera> webcam();

}  // namespace skullstation::testing
