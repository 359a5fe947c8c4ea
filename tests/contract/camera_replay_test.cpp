#include <fmt/format.h>

#include <stdexcept>
#include <type_traits>

#include "capture/cameras/replay_camera.h"
#include "core/file.h"
#include "core/session/image_file.h"
#include "tests/contract/camera_contract.h"
#include "tests/support/temporary_folder.h"

namespace skullstation::contract {
namespace {

template <class ClockType>
class ReplayWorld final : public CameraWorld {
 public:
  ReplayWorld() {
    for (int i = 0; i < 3; ++i) {
      const Image8 picture(16, 12, 3, static_cast<std::uint8_t>(40 * i));
      const auto saved =
          write_file_durably(folder_ / fmt::format("view_{}.png", i), encode_png(picture));
      if (!saved) throw std::runtime_error(saved.error().message());
    }
    auto camera =
        open_replay_camera({.pictures = *pictures_in(folder_.path()), .loop = true}, clock_);
    if (!camera) throw std::runtime_error(camera.error().message());
    camera_ = std::move(*camera);
  }

  Camera& camera() override { return *camera_; }
  Instant now() const override { return clock_.now(); }
  bool real_time() const override { return std::is_same_v<ClockType, SystemClock>; }
  std::optional<MissingSetting> missing() const override {
    return MissingSetting{{.exposure = std::chrono::milliseconds{8}}, "exposure"};
  }

 private:
  testing::TemporaryFolder folder_;
  ClockType clock_;
  std::unique_ptr<Camera> camera_;
};

INSTANTIATE_TEST_SUITE_P(
    Replay, CameraContract,
    ::testing::Values(CameraBackend{"virtual_time",
                                    [] { return std::make_unique<ReplayWorld<SimulatedClock>>(); }},
                      CameraBackend{"real_time",
                                    [] { return std::make_unique<ReplayWorld<SystemClock>>(); }}),
    backend_name);

}  // namespace
}  // namespace skullstation::contract
