#pragma once

#include <memory>
#include <string>
#include <string_view>

#include "capture/cameras/v4l2_system.h"
#include "core/result.h"

namespace skullstation {

/// What went wrong with a device, told for people: busy, unplugged, not allowed, ...
/// `doing` completes "while ...": "starting the stream".
Error v4l2_error(const std::string& device, std::string_view doing, int error_number);

/// An open video node. Closes itself.
class V4l2Device {
 public:
  /// Opens the node and checks that it is a camera that streams: kind hardware with the reason if
  /// it is missing, busy, forbidden, no video device, or another kind of video device.
  static Result<V4l2Device> open(std::shared_ptr<V4l2System> system, const std::string& node);

  V4l2Device(V4l2Device&& other) noexcept;
  V4l2Device& operator=(V4l2Device&& other) noexcept;
  ~V4l2Device();

  V4l2System& system() const { return *system_; }
  int descriptor() const { return descriptor_; }
  const std::string& node() const { return node_; }      ///< "/dev/video0"
  const std::string& driver() const { return driver_; }  ///< "uvcvideo"
  const std::string& model() const { return model_; }    ///< "HD Pro Webcam C920"
  const std::string& bus() const { return bus_; }        ///< "usb-0000:00:14.0-1"

  /// 0 or more, or -errno: for calls whose failure is an answer.
  int ioctl(unsigned long request, void* argument) const {
    return system_->ioctl(descriptor_, request, argument);
  }

  /// For calls that must succeed.
  Result<void> call(unsigned long request, void* argument, std::string_view doing) const;

 private:
  V4l2Device(std::shared_ptr<V4l2System> system, int descriptor, std::string node);

  std::shared_ptr<V4l2System> system_;
  int descriptor_ = -1;
  std::string node_;
  std::string driver_;
  std::string model_;
  std::string bus_;
};

}  // namespace skullstation
