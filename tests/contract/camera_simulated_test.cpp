#include <stdexcept>

#include "capture/simulation/placement.h"
#include "capture/simulation/simulated_camera.h"
#include "tests/contract/camera_contract.h"

namespace skullstation::contract {
namespace {

/// A bare table, so that a picture takes a few milliseconds.
class SimulatedCameraWorld final : public CameraWorld {
 public:
  explicit SimulatedCameraWorld(const SimulatedCameraFaults& faults) {
    static const auto scene = SimulatedScene::build(TriangleMesh{}, Rigid3{}, SceneOptions{}, 2);
    if (!scene) throw std::runtime_error(scene.error().message());
    SimulatedCameraOptions options;
    options.optics.lens = Lens::from_params(40, 30, LensModel::pinhole, {70.0, 70.0, 20.0, 15.0});
    options.optics.camera_from_station = camera_on_ring({0.0, 0.0, 95.0}, 650.0, 20.0);
    options.faults = faults;
    options.render.threads = 2;
    auto camera = SimulatedCamera::open(
        *scene, options, [](Instant) { return 0.0; }, clock_);
    if (!camera) throw std::runtime_error(camera.error().message());
    camera_ = *std::move(camera);
  }

  Camera& camera() override { return *camera_; }
  Instant now() const override { return clock_.now(); }
  CameraSettings lockable() const override {
    return {.exposure = std::chrono::milliseconds{4},
            .gain = 2.0,
            .white_balance_k = 5000,
            .focus = 0.3};
  }
  bool can_unplug() const override { return true; }
  void unplug() override { camera_->unplug(); }
  void plug_in() override { camera_->replug(); }

 private:
  SimulatedClock clock_;
  std::unique_ptr<SimulatedCamera> camera_;
};

CameraBackend backend(std::string name, const SimulatedCameraFaults& faults) {
  return {std::move(name), [faults] { return std::make_unique<SimulatedCameraWorld>(faults); }};
}

INSTANTIATE_TEST_SUITE_P(Simulated, CameraContract,
                         ::testing::Values(backend("sound", {}),
                                           backend("drops_frames", {.drops_every_nth = 2}),
                                           backend("damages_frames", {.corrupt_every_nth = 3})),
                         backend_name);

}  // namespace
}  // namespace skullstation::contract
