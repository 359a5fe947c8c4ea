// The contract of all cameras, fulfilled by the real backends on the kernel's virtual cameras.

#include <stdexcept>

#include "capture/cameras/libcamera_camera.h"
#include "capture/cameras/v4l2_camera.h"
#include "core/clock.h"
#include "tests/contract/camera_contract.h"
#include "tests/hardware_lab/vivid_device.h"

namespace skullstation::contract {
namespace {

std::unique_ptr<Camera> running(Result<std::unique_ptr<Camera>> opened) {
  if (!opened) throw std::runtime_error(opened.error().message());
  return *std::move(opened);
}

class KernelCameraWorld : public CameraWorld {
 public:
  Camera& camera() override { return *camera_; }
  Instant now() const override { return clock_.now(); }
  bool real_time() const override { return true; }
  // Under emulation on a busy machine a frame may take its time.
  std::chrono::milliseconds patience() const override { return std::chrono::seconds{60}; }

 protected:
  std::unique_ptr<Camera> camera_;

 private:
  SystemClock clock_;
};

class VividWorld final : public KernelCameraWorld {
 public:
  VividWorld() {
    V4l2CameraConfig config;
    config.device = VividDevice::stable_path();
    config.format.size = FrameSize{320, 180};
    config.format.frames_per_second = 30.0;
    camera_ = running(open_v4l2_camera(config));
  }

  CameraSettings lockable() const override {
    CameraSettings settings;
    settings.gain = 1.0;
    return settings;
  }
  std::optional<MissingSetting> missing() const override {
    MissingSetting missing;
    missing.settings.focus = 0.5;
    missing.name = "focus";
    return missing;
  }
  bool can_unplug() const override { return true; }
  void unplug() override { vivid_.unplug(); }
  void plug_in() override { vivid_.plug(); }

 private:
  VividDevice vivid_;
};

class VimcWorld final : public KernelCameraWorld {
 public:
  VimcWorld() {
    LibcameraConfig config;
    config.size = FrameSize{636, 480};
    camera_ = running(open_libcamera_camera(config));
  }

  std::optional<MissingSetting> missing() const override {
    MissingSetting missing;
    missing.settings.exposure = std::chrono::milliseconds{8};
    missing.name = "exposure";
    return missing;
  }
};

template <class World>
CameraBackend backend(std::string name) {
  return {std::move(name), [] { return std::make_unique<World>(); }};
}

INSTANTIATE_TEST_SUITE_P(Kernel, CameraContract, ::testing::Values(backend<VividWorld>("Vivid")),
                         backend_name);
INSTANTIATE_TEST_SUITE_P(Libcamera, CameraContract, ::testing::Values(backend<VimcWorld>("Vimc")),
                         backend_name);

}  // namespace
}  // namespace skullstation::contract
