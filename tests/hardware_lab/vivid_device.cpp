#include "tests/hardware_lab/vivid_device.h"

#include <fcntl.h>
#include <linux/videodev2.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <system_error>
#include <thread>

#include "tests/hardware_lab/kernel_file.h"

namespace skullstation {
namespace {

const std::filesystem::path driver = "/sys/bus/platform/drivers/vivid";
constexpr const char* device = "vivid.0";

// vivid's own controls have no header; these are the numbers of drivers/media/test-drivers/vivid/
// vivid-ctrls.c, which `v4l2-ctl --list-ctrls` shows.
constexpr std::uint32_t vivid_controls = 0x00f0f000;
constexpr std::uint32_t osd_text_mode = vivid_controls + 1;
constexpr std::uint32_t percentage_dropped = vivid_controls + 64;
constexpr std::uint32_t buffer_error = vivid_controls + 66;
constexpr std::uint32_t stream_start_error = vivid_controls + 69;
constexpr std::uint32_t fatal_stream_error = vivid_controls + 70;

/// udev makes the link last when a camera comes, and takes it away some time after the node has
/// gone: the link itself is looked at, not what it leads to.
void wait_for_link(bool there) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (std::filesystem::is_symlink(VividDevice::stable_path()) != there) {
    if (std::chrono::steady_clock::now() > deadline) {
      throw std::system_error(std::make_error_code(std::errc::timed_out), "udev");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace

VividDevice::VividDevice() {
  if (std::filesystem::exists(driver / device)) unplug();
  plug();
}

std::string VividDevice::stable_path() { return "/dev/v4l/by-path/platform-vivid.0-video-index0"; }

std::string VividDevice::node() { return std::filesystem::canonical(stable_path()).string(); }

void VividDevice::unplug() {
  write_kernel_file(driver / "unbind", device);
  wait_for_link(false);
}

void VividDevice::plug() {
  write_kernel_file(driver / "bind", device);
  wait_for_link(true);
}

void VividDevice::set_control(std::uint32_t id, std::int32_t value) {
  const int descriptor = ::open(stable_path().c_str(), O_RDWR | O_CLOEXEC);
  v4l2_control control{id, value};
  const int result = ::ioctl(descriptor, VIDIOC_S_CTRL, &control);
  const int reason = errno;
  ::close(descriptor);
  if (result != 0) throw std::system_error(reason, std::generic_category(), "vivid control");
}

void VividDevice::show_colour_bars() { set_control(osd_text_mode, 2); }
void VividDevice::damage_next_buffer() { set_control(buffer_error, 1); }
void VividDevice::drop_frames(int percent) { set_control(percentage_dropped, percent); }
void VividDevice::break_stream() { set_control(fatal_stream_error, 1); }
void VividDevice::refuse_next_stream_start() { set_control(stream_start_error, 1); }

}  // namespace skullstation
