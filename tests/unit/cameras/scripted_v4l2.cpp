#include "tests/unit/cameras/scripted_v4l2.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

namespace skullstation::testing {
namespace {

namespace fs = std::filesystem;

template <std::size_t N>
void put_text(__u8 (&to)[N], const std::string& text) {
  std::memcpy(to, text.data(), std::min(N - 1, text.size()));
}

std::size_t bytes_per_row(std::uint32_t fourcc, std::uint32_t width) {
  const auto pixels = pixel_format_from_fourcc(fourcc);
  return pixels ? row_bytes(*pixels, static_cast<int>(width)) : width;
}

}  // namespace

ScriptedV4l2::ScriptedV4l2() {
  fs::create_directories(root_ / "dev/v4l/by-id");
  fs::create_directories(root_ / "dev/v4l/by-path");
  fs::create_directories(root_ / "sys/class/video4linux");
}

std::string ScriptedV4l2::node(int number) const {
  return (root_ / fmt::format("dev/video{}", number)).string();
}
std::string ScriptedV4l2::by_id() const { return (root_ / "dev/v4l/by-id/usb-camera").string(); }
std::string ScriptedV4l2::by_path() const { return (root_ / "dev/v4l/by-path/port-1").string(); }

std::string ScriptedV4l2::plug_in(std::shared_ptr<ScriptedCamera> camera, int number, bool links) {
  std::ofstream(node(number)).close();
  const fs::path usb = root_ / fmt::format("sys/devices/usb{}", number);
  fs::create_directories(usb / "interface");
  fs::create_directories(root_ / fmt::format("sys/class/video4linux/video{}", number));
  fs::create_symlink(usb / "interface",
                     root_ / fmt::format("sys/class/video4linux/video{}/device", number));
  if (!camera->serial.empty()) std::ofstream(usb / "serial") << camera->serial << "\n";
  if (links) {
    fs::create_symlink(fmt::format("../../video{}", number), by_id());
    fs::create_symlink(fmt::format("../../video{}", number), by_path());
  }
  plugged_[number] = std::move(camera);
  return node(number);
}

void ScriptedV4l2::unplug(int number) {
  for (auto& [descriptor, opened] : open_) {
    if (opened.camera == plugged_[number]) opened.gone = true;
  }
  plugged_.erase(number);
  fs::remove(node(number));
  fs::remove(by_id());
  fs::remove(by_path());
  fs::remove_all(root_ / fmt::format("sys/class/video4linux/video{}", number));
}

int ScriptedV4l2::open(const std::string& path) {
  for (const auto& [number, camera] : plugged_) {
    if (fs::path(node(number)) != fs::path(path)) continue;
    if (camera->open_error != 0) return -camera->open_error;
    open_[next_descriptor_].camera = camera;
    return next_descriptor_++;
  }
  return -ENOENT;
}

void ScriptedV4l2::close(int descriptor) { open_.erase(descriptor); }

int ScriptedV4l2::ioctl(int descriptor, unsigned long request, void* argument) {
  calls.push_back(request);
  Opened& opened = open_.at(descriptor);
  if (opened.gone) return -ENODEV;
  auto& errors = opened.camera->errors[request];
  if (!errors.empty()) {
    const int error = errors.front();
    errors.pop_front();
    if (error != 0) return -error;
  }
  return dispatch(opened, request, argument);
}

int ScriptedV4l2::dispatch(Opened& opened, unsigned long request, void* argument) {
  ScriptedCamera& camera = *opened.camera;
  switch (request) {
    case VIDIOC_QUERYCAP: {
      auto& capability = *static_cast<v4l2_capability*>(argument);
      put_text(capability.driver, camera.driver);
      put_text(capability.card, camera.model);
      put_text(capability.bus_info, camera.bus);
      capability.capabilities = camera.capabilities | V4L2_CAP_DEVICE_CAPS;
      capability.device_caps = camera.capabilities;
      return 0;
    }
    case VIDIOC_ENUM_FMT: return list_formats(camera, *static_cast<v4l2_fmtdesc*>(argument));
    case VIDIOC_ENUM_FRAMESIZES:
      return list_sizes(camera, *static_cast<v4l2_frmsizeenum*>(argument));
    case VIDIOC_ENUM_FRAMEINTERVALS:
      return list_rates(camera, *static_cast<v4l2_frmivalenum*>(argument));
    case VIDIOC_S_FMT: return set_format(opened, *static_cast<v4l2_format*>(argument));
    case VIDIOC_G_PARM: return rate(opened, *static_cast<v4l2_streamparm*>(argument), false);
    case VIDIOC_S_PARM: return rate(opened, *static_cast<v4l2_streamparm*>(argument), true);
    case VIDIOC_QUERY_EXT_CTRL:
      return query_control(camera, *static_cast<v4l2_query_ext_ctrl*>(argument));
    case VIDIOC_QUERYMENU: {
      const auto& entry = *static_cast<v4l2_querymenu*>(argument);
      for (const ScriptedControl& control : camera.controls) {
        if (control.id != entry.id) continue;
        const auto& menu = control.menu;
        return std::find(menu.begin(), menu.end(), entry.index) == menu.end() ? -EINVAL : 0;
      }
      return -EINVAL;
    }
    case VIDIOC_G_EXT_CTRLS:
      return access_control(camera, *static_cast<v4l2_ext_controls*>(argument), false);
    case VIDIOC_S_EXT_CTRLS:
      return access_control(camera, *static_cast<v4l2_ext_controls*>(argument), true);
    case VIDIOC_REQBUFS:
      return request_buffers(opened, *static_cast<v4l2_requestbuffers*>(argument));
    case VIDIOC_QUERYBUF: {
      auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= opened.buffers.size()) return -EINVAL;
      buffer.length = static_cast<std::uint32_t>(opened.buffers[buffer.index].memory.size());
      buffer.m.offset = buffer.index << 12;
      buffer.flags = camera.timestamp_flags;
      return 0;
    }
    case VIDIOC_QBUF: {
      const auto& buffer = *static_cast<v4l2_buffer*>(argument);
      if (buffer.index >= opened.buffers.size()) return -EINVAL;
      opened.queued.push_back(buffer.index);
      return 0;
    }
    case VIDIOC_DQBUF: return take_buffer(opened, *static_cast<v4l2_buffer*>(argument));
    case VIDIOC_STREAMON:
      opened.streaming = true;
      opened.next_frame = now_ + camera.frame_interval;
      return 0;
    case VIDIOC_STREAMOFF: opened.streaming = false; return 0;
    default: return -ENOTTY;
  }
}

int ScriptedV4l2::list_formats(const ScriptedCamera& camera, v4l2_fmtdesc& entry) const {
  if (entry.index >= camera.formats.size()) return -EINVAL;
  entry.pixelformat = camera.formats[entry.index].fourcc;
  put_text(entry.description, camera.formats[entry.index].description);
  return 0;
}

int ScriptedV4l2::list_sizes(const ScriptedCamera& camera, v4l2_frmsizeenum& entry) const {
  for (const V4l2OfferedFormat& format : camera.formats) {
    if (format.fourcc != entry.pixel_format) continue;
    if (entry.index >= format.sizes.size()) return -EINVAL;
    const FrameSize& size = format.sizes[entry.index];
    if (format.smallest) {
      entry.type = V4L2_FRMSIZE_TYPE_STEPWISE;
      entry.stepwise.min_width = static_cast<std::uint32_t>(format.smallest->width);
      entry.stepwise.min_height = static_cast<std::uint32_t>(format.smallest->height);
      entry.stepwise.max_width = static_cast<std::uint32_t>(size.width);
      entry.stepwise.max_height = static_cast<std::uint32_t>(size.height);
      entry.stepwise.step_width = entry.stepwise.step_height = 2;
    } else {
      entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      entry.discrete.width = static_cast<std::uint32_t>(size.width);
      entry.discrete.height = static_cast<std::uint32_t>(size.height);
    }
    return 0;
  }
  return -EINVAL;
}

int ScriptedV4l2::list_rates(const ScriptedCamera& camera, v4l2_frmivalenum& entry) const {
  for (std::size_t i = 0; i < camera.formats.size(); ++i) {
    if (camera.formats[i].fourcc != entry.pixel_format) continue;
    if (i >= camera.rates.size()) return -ENOTTY;
    if (entry.index >= camera.rates[i].size()) return -EINVAL;
    entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
    entry.discrete = {1000, static_cast<std::uint32_t>(1000 * camera.rates[i][entry.index])};
    return 0;
  }
  return -EINVAL;
}

int ScriptedV4l2::set_format(Opened& opened, v4l2_format& format) const {
  const ScriptedCamera& camera = *opened.camera;
  v4l2_pix_format& pixels = format.fmt.pix;
  if (camera.size_answer) {
    pixels.width = static_cast<std::uint32_t>(camera.size_answer->width);
    pixels.height = static_cast<std::uint32_t>(camera.size_answer->height);
  }
  if (camera.format_answer) pixels.pixelformat = *camera.format_answer;
  pixels.field = camera.field_answer;
  pixels.bytesperline = static_cast<std::uint32_t>(bytes_per_row(pixels.pixelformat, pixels.width) +
                                                   camera.stride_padding);
  pixels.sizeimage = std::max(2 * pixels.bytesperline, 3 * pixels.width) * pixels.height;
  pixels.colorspace = camera.colorspace;
  pixels.ycbcr_enc = camera.ycbcr_encoding;
  opened.format = pixels;
  return 0;
}

int ScriptedV4l2::rate(Opened& opened, v4l2_streamparm& parameters, bool set) const {
  ScriptedCamera& camera = *opened.camera;
  if (!camera.rate_settable) return -ENOTTY;
  auto& capture = parameters.parm.capture;
  if (set) {
    camera.frame_interval = std::chrono::nanoseconds{
        1'000'000'000LL * capture.timeperframe.numerator / capture.timeperframe.denominator};
  }
  capture.capability = V4L2_CAP_TIMEPERFRAME;
  capture.timeperframe = {static_cast<std::uint32_t>(camera.frame_interval.count() / 1000),
                          1'000'000};
  return 0;
}

int ScriptedV4l2::query_control(const ScriptedCamera& camera, v4l2_query_ext_ctrl& query) const {
  const bool next = (query.id & V4L2_CTRL_FLAG_NEXT_CTRL) != 0;
  const std::uint32_t id = query.id & ~V4L2_CTRL_FLAG_NEXT_CTRL;
  for (const ScriptedControl& control : camera.controls) {  // ordered by id
    if (next ? control.id <= id : control.id != id) continue;
    query = {};
    query.id = control.id;
    query.type = control.type;
    std::memcpy(query.name, control.name.data(), std::min<std::size_t>(31, control.name.size()));
    query.minimum = control.minimum;
    query.maximum = control.maximum;
    query.step = static_cast<std::uint64_t>(control.step);
    query.flags = control.flags;
    return 0;
  }
  return -EINVAL;
}

int ScriptedV4l2::access_control(ScriptedCamera& camera, v4l2_ext_controls& batch, bool set) const {
  v4l2_ext_control& entry = *batch.controls;
  for (ScriptedControl& control : camera.controls) {
    if (control.id != entry.id) continue;
    const bool wide = control.type == V4L2_CTRL_TYPE_INTEGER64;
    if (set) {
      if (control.set_error != 0) return -control.set_error;
      const std::int64_t asked = wide ? std::int64_t{entry.value64} : std::int64_t{entry.value};
      const std::int64_t steps =
          (std::clamp(asked, control.minimum, control.maximum) - control.minimum) / control.step;
      if (!control.stuck) control.value = control.minimum + steps * control.step;
    } else if (control.get_error != 0) {
      return -control.get_error;
    }
    if (wide) {
      entry.value64 = control.value;
    } else {
      entry.value = static_cast<std::int32_t>(control.value);
    }
    return 0;
  }
  return -EINVAL;
}

int ScriptedV4l2::request_buffers(Opened& opened, v4l2_requestbuffers& request) const {
  request.count = std::min(request.count, opened.camera->most_buffers);
  opened.queued.clear();
  opened.done.clear();
  opened.buffers.assign(request.count, Buffer{});
  for (Buffer& buffer : opened.buffers) buffer.memory.resize(opened.format.sizeimage);
  return 0;
}

void* ScriptedV4l2::map(int descriptor, std::size_t, std::int64_t offset) {
  Opened& opened = open_.at(descriptor);
  if (!opened.camera->maps) return nullptr;
  ++mapped_;
  return opened.buffers[static_cast<std::size_t>(offset >> 12)].memory.data();
}

void ScriptedV4l2::unmap(void*, std::size_t) { --mapped_; }

/// What a sensor does: a frame at every interval, into the next queued buffer if there is one.
void ScriptedV4l2::expose_until(Opened& opened, Instant moment) const {
  ScriptedCamera& camera = *opened.camera;
  while (opened.next_frame <= moment) {
    ScriptedFrame frame;
    if (!camera.script.empty()) {
      frame = camera.script.front();
      camera.script.pop_front();
    }
    if (!frame.dropped && !camera.all_dropped && !opened.queued.empty()) fill(opened, frame);
    ++opened.sequence;
    opened.next_frame += camera.frame_interval;
  }
}

void ScriptedV4l2::fill(Opened& opened, const ScriptedFrame& frame) const {
  const ScriptedCamera& camera = *opened.camera;
  const std::uint32_t index = opened.queued.front();
  opened.queued.pop_front();
  Buffer& buffer = opened.buffers[index];
  const auto& picture = frame.bytes ? *frame.bytes : camera.picture;
  if (frame.bytes || !picture.empty()) {
    buffer.used = std::min(picture.size(), buffer.memory.size());
    std::copy_n(picture.begin(), buffer.used, buffer.memory.begin());
  } else {
    const auto pixels = pixel_format_from_fourcc(opened.format.pixelformat);
    buffer.used = buffer_bytes({.pixels = *pixels,
                                .width = static_cast<int>(opened.format.width),
                                .height = static_cast<int>(opened.format.height),
                                .stride_bytes = opened.format.bytesperline});
    std::fill_n(buffer.memory.begin(), buffer.used, camera.fill);
  }
  buffer.flags = camera.timestamp_flags | (frame.damaged ? V4L2_BUF_FLAG_ERROR : 0U);
  buffer.timestamp = opened.next_frame - frame.age;
  buffer.sequence = opened.sequence;
  opened.done.push_back(index);
}

int ScriptedV4l2::take_buffer(Opened& opened, v4l2_buffer& buffer) const {
  if (!opened.streaming) return -EINVAL;
  if (opened.done.empty()) return -EAGAIN;
  buffer.index = opened.done.front();
  opened.done.pop_front();
  const Buffer& filled = opened.buffers[buffer.index];
  buffer.bytesused = static_cast<std::uint32_t>(filled.used);
  buffer.flags = filled.flags;
  buffer.sequence = filled.sequence;
  const auto stamp = filled.timestamp.time_since_epoch();
  const auto seconds = std::chrono::floor<std::chrono::seconds>(stamp);
  buffer.timestamp.tv_sec = seconds.count();
  buffer.timestamp.tv_usec =
      std::chrono::duration_cast<std::chrono::microseconds>(stamp - seconds).count();
  return 0;
}

int ScriptedV4l2::wait(int descriptor, Instant deadline, std::stop_token stop) {
  if (on_wait) on_wait();
  if (stop.stop_requested()) return -ECANCELED;
  Opened& opened = open_.at(descriptor);
  if (opened.gone || opened.camera->hangs_up) return -EPIPE;
  expose_until(opened, now_);
  while (opened.done.empty() && opened.next_frame <= deadline) {
    now_ = std::max(now_, opened.next_frame);
    expose_until(opened, now_);
  }
  if (!opened.done.empty()) return 1;
  now_ = std::max(now_, deadline);
  return 0;
}

std::shared_ptr<ScriptedCamera> webcam() {
  auto camera = std::make_shared<ScriptedCamera>();
  camera->formats = {
      {V4L2_PIX_FMT_MJPEG, "Motion-JPEG", {{640, 480}, {1600, 1200}}, {}},
      {V4L2_PIX_FMT_GREY, "8-bit Greyscale", {{640, 480}}, {}},
      {V4L2_PIX_FMT_YUYV, "YUYV 4:2:2", {{320, 240}, {640, 480}}, {}},
  };
  camera->controls = {
      {V4L2_CID_BRIGHTNESS, "Brightness", V4L2_CTRL_TYPE_INTEGER, 0, 255, 1, 128},
      {V4L2_CID_AUTO_WHITE_BALANCE, "White Balance, Automatic", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1, 1},
      {V4L2_CID_GAIN, "Gain", V4L2_CTRL_TYPE_INTEGER, 16, 255, 1, 64},
      {V4L2_CID_WHITE_BALANCE_TEMPERATURE, "White Balance Temperature", V4L2_CTRL_TYPE_INTEGER,
       2000, 6500, 10, 4000},
      {V4L2_CID_EXPOSURE_AUTO, "Auto Exposure", V4L2_CTRL_TYPE_MENU, 0, 3, 1, 3, 0, {1, 3}},
      {V4L2_CID_EXPOSURE_ABSOLUTE, "Exposure Time, Absolute", V4L2_CTRL_TYPE_INTEGER, 3, 2047, 1,
       250},
      {V4L2_CID_FOCUS_ABSOLUTE, "Focus, Absolute", V4L2_CTRL_TYPE_INTEGER, 0, 250, 5, 30},
      {V4L2_CID_FOCUS_AUTO, "Focus, Automatic Continuous", V4L2_CTRL_TYPE_BOOLEAN, 0, 1, 1, 1},
  };
  return camera;
}

}  // namespace skullstation::testing
