#include "capture/cameras/v4l2_discovery.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <string_view>

namespace skullstation {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kBusPrefix = "bus:";
constexpr std::string_view kNodePrefix = "video";

/// dev/video0, dev/video1, ..., in the order of their numbers.
std::vector<std::string> video_nodes(const V4l2System& system) {
  std::vector<std::pair<int, std::string>> numbered;
  std::error_code ignored;  // no dev folder: no nodes
  for (const auto& entry : fs::directory_iterator(system.root() / "dev", ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kNodePrefix)) continue;
    const std::string number = name.substr(kNodePrefix.size());
    const bool digits = !number.empty() && number.size() < 6 &&
                        std::all_of(number.begin(), number.end(),
                                    [](unsigned char letter) { return std::isdigit(letter) != 0; });
    if (digits) numbered.emplace_back(std::stoi(number), entry.path().string());
  }
  std::sort(numbered.begin(), numbered.end());
  std::vector<std::string> nodes;
  nodes.reserve(numbered.size());
  for (auto& [number, node] : numbered) nodes.push_back(std::move(node));
  return nodes;
}

/// The link in dev/v4l/`kind` that leads to the node; empty if there is none.
std::string link_to(const V4l2System& system, std::string_view kind, const std::string& node) {
  std::error_code ignored;  // no such folder: no udev
  const fs::path target = fs::canonical(node, ignored);
  std::vector<std::string> links;
  for (const auto& entry : fs::directory_iterator(system.root() / "dev/v4l" / kind, ignored)) {
    std::error_code dangling;
    if (fs::canonical(entry.path(), dangling) == target && !dangling) {
      links.push_back(entry.path().string());
    }
  }
  // by-path may hold two names of one port; the first in order is always the same.
  return links.empty() ? std::string{} : *std::min_element(links.begin(), links.end());
}

/// The nodes of usable cameras at a place on the bus.
std::vector<std::string> nodes_on_bus(const std::shared_ptr<V4l2System>& system,
                                      std::string_view bus) {
  std::vector<std::string> nodes;
  for (const std::string& node : video_nodes(*system)) {
    const auto device = V4l2Device::open(system, node);
    if (device && device->bus() == bus) nodes.push_back(node);
  }
  return nodes;
}

tl::unexpected<Error> not_there(const std::string& device) {
  return tl::unexpected(v4l2_error(device, "looking for it", ENOENT));
}

}  // namespace

std::string serial_of(const V4l2System& system, const std::string& node) {
  // sys/class/video4linux/video0/device leads to the USB interface; the device is its parent.
  std::error_code error;
  const fs::path interface = fs::canonical(
      system.root() / "sys/class/video4linux" / fs::path(node).filename() / "device", error);
  if (error) return {};
  std::ifstream file(interface.parent_path() / "serial");
  std::string serial;
  std::getline(file, serial);
  return serial;
}

std::string stable_path_of(const std::shared_ptr<V4l2System>& system, const V4l2Device& device) {
  if (!serial_of(*system, device.node()).empty()) {
    if (std::string link = link_to(*system, "by-id", device.node()); !link.empty()) return link;
  }
  if (std::string link = link_to(*system, "by-path", device.node()); !link.empty()) return link;
  const std::vector<std::string> here = nodes_on_bus(system, device.bus());
  const auto position = std::find(here.begin(), here.end(), device.node()) - here.begin();
  return position == 0 ? fmt::format("{}{}", kBusPrefix, device.bus())
                       : fmt::format("{}{}#{}", kBusPrefix, device.bus(), position);
}

Result<std::string> find_node(const std::shared_ptr<V4l2System>& system,
                              const std::string& device) {
  if (!device.starts_with(kBusPrefix)) {
    std::error_code missing;
    const fs::path node = fs::canonical(device, missing);
    if (missing) return not_there(device);
    return node.string();
  }
  std::string_view bus = std::string_view(device).substr(kBusPrefix.size());
  std::size_t position = 0;
  if (const auto mark = bus.rfind('#'); mark != std::string_view::npos) {
    for (const char digit : bus.substr(mark + 1)) {
      if (std::isdigit(static_cast<unsigned char>(digit)) == 0) return not_there(device);
      position = 10 * position + static_cast<std::size_t>(digit - '0');
    }
    bus = bus.substr(0, mark);
  }
  const std::vector<std::string> here = nodes_on_bus(system, bus);
  if (position >= here.size()) return not_there(device);
  return here[position];
}

std::vector<V4l2CameraInfo> list_v4l2_cameras(const std::shared_ptr<V4l2System>& system) {
  std::vector<V4l2CameraInfo> cameras;
  for (const std::string& node : video_nodes(*system)) {
    V4l2CameraInfo info;
    info.node = node;
    const int descriptor = system->open(node);
    if (descriptor < 0) {
      info.problem = v4l2_error(node, "opening it", -descriptor).what;
      cameras.push_back(std::move(info));
      continue;
    }
    system->close(descriptor);
    const auto device = V4l2Device::open(system, node);
    if (!device) continue;  // another kind of node
    info.stable_path = stable_path_of(system, *device);
    info.model = device->model();
    info.serial = serial_of(*system, node);
    info.driver = device->driver();
    if (auto formats = offered_formats(*device)) {
      info.formats = std::move(*formats);
    } else {
      info.problem = formats.error().what;
    }
    cameras.push_back(std::move(info));
  }
  return cameras;
}

std::vector<V4l2CameraInfo> list_v4l2_cameras() { return list_v4l2_cameras(kernel_v4l2_system()); }

}  // namespace skullstation
