#include <fmt/format.h>

#include "capture/cameras/libcamera_camera.h"

namespace skullstation {

Result<void> LibcameraConfig::validate() const {
  if (size && (size->width <= 0 || size->height <= 0)) {
    return fail(ErrorKind::bad_input, "size",
                fmt::format("is {}x{}, expected pixels", size->width, size->height));
  }
  if (buffers < 2 || buffers > 32) {
    return fail(ErrorKind::bad_input, "buffers", fmt::format("is {}, expected 2 to 32", buffers));
  }
  if (settle_frames < 0) {
    return fail(ErrorKind::bad_input, "settle_frames",
                fmt::format("is {}, expected 0 or more", settle_frames));
  }
  return {};
}

}  // namespace skullstation
