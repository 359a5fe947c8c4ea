#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "capture/cameras/camera.h"
#include "capture/simulation/render.h"
#include "capture/simulation/scene.h"
#include "capture/simulation/sensor.h"
#include "core/clock.h"

namespace skullstation {

/// What can go wrong with a simulated camera, switched on one by one.
struct SimulatedCameraFaults {
  bool dead = false;                               ///< not there when it is opened
  std::optional<int> unplugged_after_frames = {};  ///< frames handed out until the cable comes off
  bool silent = false;                             ///< streams, yet no frame ever arrives
  std::optional<int> times_out_every_nth = {};  ///< requests for a frame that time out: n, 2n, ...
  std::optional<int> drops_every_nth = {};      ///< frames lost on the bus; the next one is good
  std::optional<int> corrupt_every_nth = {};    ///< frames that the device flags as damaged
  bool overexposed = false;       ///< a stop and a half more light than the lamps give
  bool ignores_exposure = false;  ///< keeps its default exposure, and says so
};

struct SimulatedCameraOptions {
  std::string serial = "SIM-1";
  CameraOptics optics;
  SensorOptions sensor;
  RenderOptions render;                            ///< its seed is also that of the noise
  std::chrono::microseconds frame_period{66'667};  ///< between the beginnings of two exposures
  std::chrono::microseconds default_exposure{8000};
  SimulatedCameraFaults faults;

  Result<void> validate() const;
};

/// A camera that looks at a SimulatedScene: a product part, used by the demo, by `--simulate` and
/// by the tests. It streams like a real one, one exposure every frame period on the given clock,
/// but only frames that are asked for are rendered, and only the noise is drawn anew while the
/// table, the scene and the focus stay as they are. With a SimulatedClock, waiting for a frame
/// takes the clock to the end of that frame's exposure and readout.
///
/// A frame's pixels follow from the options, the settings in force, the scene, the table's angles
/// during the exposure and the frame's number alone.
class SimulatedCamera final : public Camera {
 public:
  /// `true_table_angle_deg` tells where the platter really is at a moment that has passed
  /// (SimulatedStation::true_table_angle_deg). The clock must outlive the camera. Errors:
  /// bad_input for options that make no sense, hardware for a dead camera.
  static Result<std::unique_ptr<SimulatedCamera>> open(
      std::shared_ptr<const SimulatedScene> scene, const SimulatedCameraOptions& options,
      std::function<double(Instant)> true_table_angle_deg, Clock& clock);

  CameraDescription description() const override;
  Result<Frame> frame_after(Instant not_before, std::chrono::milliseconds timeout,
                            std::stop_token stop) override;
  Result<std::vector<CameraControl>> controls() override;
  Result<std::vector<LockedSetting>> lock(const CameraSettings& settings) override;
  Result<void> reopen() override;

  /// What a hand does: pulls the cable, puts it back (reopen() then works; an
  /// unplugged_after_frames fault has had its effect).
  void unplug();
  void replug();

  /// The optics in force (with the focus last locked): the truth for whoever measures the camera.
  const CameraOptics& optics() const;

  ~SimulatedCamera() override;

 private:
  struct State;
  explicit SimulatedCamera(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace skullstation
