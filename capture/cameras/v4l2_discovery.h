#pragma once

#include <memory>
#include <string>
#include <vector>

#include "capture/cameras/v4l2_format.h"
#include "capture/cameras/v4l2_system.h"

namespace skullstation {

/// A camera that was found, or a node that looks like one and can't be used.
struct V4l2CameraInfo {
  std::string node;         ///< "/dev/video0"
  std::string stable_path;  ///< see stable_path_of()
  std::string model;
  std::string serial;  ///< empty if it has none
  std::string driver;
  std::vector<V4l2OfferedFormat> formats;
  std::string problem;  ///< why it can't be used; empty if it can
};

/// Every V4L2 node that takes pictures, ordered by number. Nodes for output, metadata or other
/// purposes are left out; busy or forbidden ones are listed with their problem.
std::vector<V4l2CameraInfo> list_v4l2_cameras();
std::vector<V4l2CameraInfo> list_v4l2_cameras(const std::shared_ptr<V4l2System>& system);

/// The USB serial number of a node, from sysfs; empty if it has none.
std::string serial_of(const V4l2System& system, const std::string& node);

/// A name that finds the same camera again after it was unplugged:
/// - its link in /dev/v4l/by-id, if it has a serial number (without one, two cameras of a model
///   share that link);
/// - else its link in /dev/v4l/by-path, which stands for the socket it is plugged into;
/// - else, where udev makes no links, "bus:" and the driver's name of its place on the bus
///   ("bus:platform:vivid-000"), with "#1", "#2", ... for further cameras at the same place.
std::string stable_path_of(const std::shared_ptr<V4l2System>& system, const V4l2Device& device);

/// The node that a device path (with links followed) or a "bus:" name stands for now. Error (kind
/// hardware): nothing is there.
Result<std::string> find_node(const std::shared_ptr<V4l2System>& system, const std::string& device);

}  // namespace skullstation
