// The V4L2 backend on scripted devices; tests/hardware_lab runs it on a kernel's.
#include <stdexcept>

#include "capture/cameras/v4l2_camera.h"
#include "tests/contract/camera_contract.h"
#include "tests/unit/cameras/scripted_v4l2.h"

namespace skullstation::contract {
namespace {

using testing::ScriptedCamera;
using testing::ScriptedV4l2;
using testing::webcam;

/// A driver's peculiarities, put on the webcam that all have in common.
using Peculiarity = std::function<void(ScriptedCamera&)>;

class V4l2World final : public CameraWorld {
 public:
  explicit V4l2World(Peculiarity peculiarity) : peculiarity_(std::move(peculiarity)) {
    V4l2CameraConfig config;
    config.device = plug_in_as(0);
    config.format.size = FrameSize{320, 240};
    auto camera = open_v4l2_camera(config, system_);
    if (!camera) throw std::runtime_error(camera.error().message());
    camera_ = std::move(*camera);
  }

  Camera& camera() override { return *camera_; }
  Instant now() const override { return system_->now(); }
  CameraSettings lockable() const override {
    return {.exposure = std::chrono::milliseconds{8}, .gain = 1.0, .white_balance_k = 5000};
  }
  std::optional<MissingSetting> missing() const override {
    return MissingSetting{{.focus = 0.5}, "focus"};
  }
  bool can_unplug() const override { return true; }
  void unplug() override { system_->unplug(number_); }
  void plug_in() override { plug_in_as(number_ + 3); }

 private:
  std::string plug_in_as(int number) {
    number_ = number;
    auto device = webcam();
    std::erase_if(device->controls,
                  [](const auto& control) { return control.name.starts_with("Focus"); });
    peculiarity_(*device);
    return system_->plug_in(device, number);
  }

  Peculiarity peculiarity_;
  std::shared_ptr<ScriptedV4l2> system_ = std::make_shared<ScriptedV4l2>();
  int number_ = 0;
  std::unique_ptr<Camera> camera_;
};

CameraBackend backend(std::string name, Peculiarity peculiarity) {
  return {std::move(name), [peculiarity = std::move(peculiarity)] {
            return std::make_unique<V4l2World>(peculiarity);
          }};
}

INSTANTIATE_TEST_SUITE_P(
    V4l2, CameraContract,
    ::testing::Values(backend("plain", [](ScriptedCamera&) {}),
                      backend("uvc", [](ScriptedCamera& camera) { camera.driver = "uvcvideo"; }),
                      backend("stamped_at_the_end",
                              [](ScriptedCamera& camera) {
                                camera.timestamp_flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
                                camera.rate_settable = false;
                              }),
                      backend("two_buffers",
                              [](ScriptedCamera& camera) { camera.most_buffers = 2; }),
                      backend("unreliable",
                              [](ScriptedCamera& camera) {
                                for (int i = 0; i < 500; ++i) {
                                  camera.script.push_back(
                                      {.dropped = i % 3 == 1, .damaged = i % 4 == 1});
                                }
                              })),
    backend_name);

}  // namespace
}  // namespace skullstation::contract
