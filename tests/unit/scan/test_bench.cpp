#include "tests/unit/scan/test_bench.h"

#include <cmath>
#include <fstream>

#include "core/random.h"

namespace skullstation::testing {

namespace fs = std::filesystem;

Image8 good_picture(int width, int height, std::uint64_t noise_seed) {
  Image8 image(width, height, 1);
  Random noise(noise_seed);
  const double radius = 0.35 * height;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const double distance = std::hypot(x + 0.5 - width / 2.0, y + 0.5 - height / 2.0);
      double level = 20.0;
      if (distance < radius) {
        Random texture(mix(7, static_cast<std::uint64_t>(y) * 100'000 + x));
        level = 140.0 + texture.uniform(-40.0, 40.0);
      }
      image.at(x, y) = static_cast<std::uint8_t>(std::lround(level + noise.uniform(-2.0, 2.0)));
    }
  }
  return image;
}

CameraDescription FakeCamera::description() const {
  return {"fake", "Fake Camera 1", "F-17", "/dev/fake", "GREY 96x72"};
}

Result<Frame> FakeCamera::frame_after(Instant not_before, std::chrono::milliseconds,
                                      std::stop_token stop) {
  on_request(++requests);
  if (stop.stop_requested()) return fail(ErrorKind::cancelled, "fake camera", "stopped");
  if (unplugged_at.contains(requests)) unplugged_ = true;
  if (unplugged_) return fail(ErrorKind::hardware, "fake camera", "was unplugged");
  const Instant start = std::max(not_before, clock_.now());
  clock_.sleep_until(start + std::chrono::milliseconds(10), {});
  exposures.push_back(start);
  Frame frame;
  frame.image = picture(requests);
  frame.exposure_start = start;
  frame.exposure = std::chrono::microseconds(8000);
  return frame;
}

Result<void> FakeCamera::reopen() {
  ++reopened;
  if (!can_be_reopened) return fail(ErrorKind::hardware, "fake camera", "is not there");
  unplugged_ = false;
  return {};
}

Result<void> InstantTurntable::move_to(double angle_deg, std::stop_token stop) {
  if (stop.stop_requested()) return fail(ErrorKind::cancelled, "turntable", "stopped on request");
  angle_deg_ = angle_deg;
  return {};
}

Result<void> InstantTurntable::release() {
  angle_deg_.reset();
  return {};
}

TestBench::TestBench(const SimulatedFaults& faults, const TurntableConfig& turntable)
    : station(turntable, faults, clock, 1), hardware(station.hardware()) {
  options.plan.rings = {{"cam0", 4}, {"cam1", 2}};
  options.station = "ST-01";
  options.case_number = "2026-0042";
}

void TestBench::use_instant_turntable() {
  hardware.turntable = std::make_unique<InstantTurntable>();
}

bool TestBench::motor_is_on() const {
  return station.motor_current_on() || hardware.turntable->angle_deg().has_value();
}

Result<ScanReport> TestBench::scan(const fs::path& folder, const Progress& progress) {
  ScanStation scan_station{
      hardware,
      {{"cam0", camera0, lens, 12.0}, {"cam1", camera1, lens, std::nullopt}},
      clock,
      [this](const PlacementRequest& request, std::stop_token stop) -> Result<void> {
        placements.push_back(request);
        on_placement(request);
        if (stop.stop_requested()) return fail(ErrorKind::cancelled, "button", "cancelled");
        return {};
      },
      // Without write_file_durably's fsync, which would make these tests slow.
      [this](const fs::path& path, std::string_view bytes) -> Result<void> {
        const int write = ++writes;
        const fs::path part = path.string() + ".part";
        std::ofstream(part, std::ios::binary) << bytes.substr(0, bytes.size() / 2);
        if (Result<void> may = before_write(write); !may) return may;
        std::ofstream(part, std::ios::binary) << bytes;
        fs::rename(part, path);
        after_write(write);
        return {};
      }};
  Progress watched = progress;
  watched.report = [this, &progress](double fraction, std::string_view stage) {
    fractions.push_back(fraction);
    stages.emplace_back(stage);
    progress.report(fraction, stage);
  };
  return run_scan(options, scan_station, folder, watched);
}

std::set<std::string> files_in(const fs::path& folder) {
  std::set<std::string> files;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_directory()) files.insert(entry.path().lexically_relative(folder).string());
  }
  return files;
}

}  // namespace skullstation::testing
