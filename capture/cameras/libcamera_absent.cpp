// Compiled in place of the libcamera backend where the library is not installed.
#include "capture/cameras/libcamera_camera.h"

namespace skullstation {
namespace {

tl::unexpected<Error> absent() {
  return fail(ErrorKind::hardware, "libcamera", "this build has no libcamera",
              "install libcamera-dev and build again, or use the V4L2 backend");
}

}  // namespace

Result<std::vector<LibcameraInfo>> list_libcamera_cameras() { return absent(); }

Result<std::unique_ptr<Camera>> open_libcamera_camera(const LibcameraConfig&) { return absent(); }

}  // namespace skullstation
