#pragma once

#include <cstdint>
#include <string>

namespace skullstation {

/// The kernel's virtual camera (vivid) from the outside: what a hand, a bad cable or a failing
/// sensor does to it. It is plugged in afresh, all controls at their defaults, by the constructor.
/// Functions throw std::system_error where the kernel refuses.
class VividDevice {
 public:
  VividDevice();

  /// As udev names it for ever: "/dev/v4l/by-path/...".
  static std::string stable_path();
  /// What that leads to now: "/dev/video0".
  static std::string node();

  /// Pulls the plug, whoever streams; plug() puts it in again. Both return when udev is done.
  void unplug();
  void plug();

  /// Sets a V4L2 control behind the back of the code under test.
  void set_control(std::uint32_t id, std::int32_t value);

  /// Test pictures: 75 % colour bars without any text.
  void show_colour_bars();
  /// Flags the next buffer as damaged.
  void damage_next_buffer();
  /// Loses this share of all frames.
  void drop_frames(int percent);
  /// Breaks the stream as a dying device does: EIO until it is opened afresh.
  void break_stream();
  /// The next attempt to start the stream fails.
  void refuse_next_stream_start();
};

}  // namespace skullstation
