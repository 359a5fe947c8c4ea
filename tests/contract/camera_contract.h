#pragma once

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "capture/cameras/camera.h"
#include "core/clock.h"

namespace skullstation::contract {

/// A running camera and the hand that plugs its cable.
class CameraWorld {
 public:
  virtual ~CameraWorld() = default;
  virtual Camera& camera() = 0;
  virtual Instant now() const = 0;

  /// False where waiting takes no real time.
  virtual bool real_time() const { return false; }
  /// Longest wait for one frame.
  virtual std::chrono::milliseconds patience() const { return std::chrono::seconds{10}; }

  /// Settings that this camera has; empty if it has none.
  virtual CameraSettings lockable() const { return {}; }
  /// One setting that it has not, and its name; nothing if it has all.
  struct MissingSetting {
    CameraSettings settings;
    std::string name;
  };
  virtual std::optional<MissingSetting> missing() const { return std::nullopt; }

  virtual bool can_unplug() const { return false; }
  virtual void unplug() {}
  virtual void plug_in() {}
};

struct CameraBackend {
  std::string name;
  std::function<std::unique_ptr<CameraWorld>()> make;
};

/// One suite for all cameras. A test program takes part by linking skullstation::camera_contract
/// and instantiating it:
///   INSTANTIATE_TEST_SUITE_P(V4l2, CameraContract, ::testing::Values(CameraBackend{...}),
///                            backend_name);
class CameraContract : public ::testing::TestWithParam<CameraBackend> {
 protected:
  CameraContract() : world_(GetParam().make()) {}

  CameraWorld& world() { return *world_; }
  Camera& camera() { return world_->camera(); }

  /// A frame exposed from now on, which must come.
  Frame fresh_frame();
  /// Everything that the camera says about its settings and that a frame shows of them.
  void expect_in_force(const std::vector<LockedSetting>& locked);

 private:
  std::unique_ptr<CameraWorld> world_;
};

inline std::string backend_name(const ::testing::TestParamInfo<CameraBackend>& tested) {
  return tested.param.name;
}

}  // namespace skullstation::contract
