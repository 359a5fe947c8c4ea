#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <stop_token>
#include <string>
#include <vector>

#include "capture/scan/scan_session.h"
#include "core/clock.h"
#include "firmware_io/simulated_station.h"

namespace skullstation::testing {

/// A bright, textured ball before a dark backdrop, a little noise on it: passes every gate.
Image8 good_picture(int width, int height, std::uint64_t noise_seed);

/// What the test does to the program at some moment: thrown through it, as a crash is.
struct Crash {};

/// A camera that serves made-up pictures and can be made to fail.
class FakeCamera final : public Camera {
 public:
  explicit FakeCamera(Clock& clock) : clock_(clock) {}

  CameraDescription description() const override;
  Result<Frame> frame_after(Instant not_before, std::chrono::milliseconds timeout,
                            std::stop_token stop) override;
  Result<std::vector<CameraControl>> controls() override { return std::vector<CameraControl>{}; }
  Result<std::vector<LockedSetting>> lock(const CameraSettings&) override {
    return std::vector<LockedSetting>{};
  }
  Result<void> reopen() override;

  /// Called at the beginning of each request with its number, from 1.
  std::function<void(int request)> on_request = [](int) {};
  /// The picture of a request.
  std::function<Image8(int request)> picture = [](int request) {
    return good_picture(96, 72, static_cast<std::uint64_t>(request));
  };
  std::set<int> unplugged_at;  ///< requests at which the cable comes off
  bool can_be_reopened = true;

  std::vector<Instant> exposures;
  int requests = 0;
  int reopened = 0;

 private:
  Clock& clock_;
  bool unplugged_ = false;
};

/// A turntable that is where it shall be at once: for tests that scan a hundred times.
class InstantTurntable final : public Turntable {
 public:
  Result<void> home(std::stop_token stop) override { return move_to(0.0, std::move(stop)); }
  Result<void> move_to(double angle_deg, std::stop_token stop) override;
  Result<void> release() override;
  std::optional<double> angle_deg() const override { return angle_deg_; }

 private:
  std::optional<double> angle_deg_;
};

/// A simulated station with two fake cameras in virtual time, and a small scan for it: rings of 4
/// and 2 views in 2 passes, 12 views in all.
struct TestBench {
  explicit TestBench(const SimulatedFaults& faults = {}, const TurntableConfig& turntable = {});

  /// Replaces the simulated platter, its thread and its steps.
  void use_instant_turntable();
  bool motor_is_on() const;

  /// Scans into `folder`; may throw Crash.
  Result<ScanReport> scan(const std::filesystem::path& folder, const Progress& progress = {});

  SimulatedClock clock;
  SimulatedStation station;
  StationHardware hardware;
  FakeCamera camera0{clock};
  FakeCamera camera1{clock};
  ScanOptions options;
  std::optional<Lens> lens;  ///< of both cameras

  std::function<void(const PlacementRequest&)> on_placement = [](const PlacementRequest&) {};
  std::vector<PlacementRequest> placements;
  /// Called before each file is written, with its number from 1, and afterwards.
  std::function<Result<void>(int write)> before_write = [](int) { return Result<void>{}; };
  std::function<void(int write)> after_write = [](int) {};
  int writes = 0;
  std::vector<std::string> stages;
  std::vector<double> fractions;
};

/// Every file below the folder, by its path inside it.
std::set<std::string> files_in(const std::filesystem::path& folder);

}  // namespace skullstation::testing
