#include <fmt/format.h>

#include <cmath>
#include <optional>

#include "capture/calibration/calibration_file.h"
#include "capture/calibration/utc_text.h"

namespace skullstation {

namespace {

// From these on the table's motion shows in a reconstruction: 0.05 deg is 0.1 mm at a skull's
// outside, and 0.02 % of a full turn is 0.07 deg.
constexpr double tolerated_ratio = 0.0002;
constexpr double tolerated_angle_rms_deg = 0.05;
constexpr double tolerated_wobble_mm = 0.3;

std::optional<std::string> age_warning(const std::string& created, UtcTime now,
                                       std::chrono::days max_age) {
  const std::optional<UtcTime> made = from_iso8601(created);
  if (!made) return fmt::format("has no readable date (\"{}\")", created);
  const double age_days = std::chrono::duration<double, std::ratio<86400>>(now - *made).count();
  if (age_days < -1.0) {
    return fmt::format("is dated {}, after now: one of the clocks was wrong", created);
  }
  if (now - *made > max_age) {
    return fmt::format("is {:.0f} days old; valid are {} days", age_days, max_age.count());
  }
  return std::nullopt;
}

}  // namespace

std::vector<std::string> motion_verdicts(const TableCalibration& calibration) {
  std::vector<std::string> verdicts;
  if (calibration.reversed) {
    verdicts.emplace_back(
        "the table turns against the commanded direction: set its direction the other way in "
        "station.toml, or swap one coil's wires");
  }
  const double excess = calibration.turn_ratio - 1.0;
  if (std::abs(excess) > tolerated_ratio && std::abs(excess) > 4.0 * calibration.turn_ratio_error) {
    const bool regular = calibration.angle_rms_deg <= tolerated_angle_rms_deg;
    verdicts.push_back(fmt::format(
        "the table turns {:.{}f} % {} than commanded: {}", 100.0 * std::abs(excess),
        std::abs(excess) < 0.0095 ? 2 : 1, excess < 0.0 ? "less" : "more",
        regular ? fmt::format("multiply steps_per_turn by {:.5f}, unless the platter slips on its "
                              "drive by the same part at every stop",
                              1.0 / calibration.turn_ratio)
                : std::string("and irregularly: the platter slips on its drive, or the motor loses "
                              "steps")));
  }
  if (calibration.angle_rms_deg > tolerated_angle_rms_deg) {
    verdicts.push_back(fmt::format(
        "the table stops {:.2f} deg (RMS) off its commanded angles even at the best "
        "steps_per_turn: "
        "it slips or loses steps now and then; check the drive, the acceleration and the load",
        calibration.angle_rms_deg));
  }
  if (calibration.wobble_mm > tolerated_wobble_mm) {
    verdicts.push_back(
        fmt::format("the platter wobbles by {:.2f} mm at the board's rim: check its bearing, and "
                    "that the board lies flat and still",
                    calibration.wobble_mm));
  }
  return verdicts;
}

std::vector<std::string> calibration_warnings(const CameraCalibration& calibration,
                                              const std::string& device, UtcTime now,
                                              std::chrono::days max_age) {
  std::vector<std::string> warnings;
  const std::string subject = fmt::format("the calibration of camera {}", calibration.camera);
  if (calibration.device != device) {
    warnings.push_back(fmt::format("{} was made with \"{}\", in use is \"{}\": calibrate again",
                                   subject, calibration.device, device));
  }
  if (const auto age = age_warning(calibration.created, now, max_age)) {
    warnings.push_back(fmt::format("{} {}: calibrate again", subject, *age));
  }
  return warnings;
}

std::vector<std::string> calibration_warnings(const TableCalibration& calibration, UtcTime now,
                                              std::chrono::days max_age) {
  std::vector<std::string> warnings;
  if (const auto age = age_warning(calibration.created, now, max_age)) {
    warnings.push_back(fmt::format("the calibration of the table {}: calibrate again", *age));
  }
  for (const std::string& verdict : motion_verdicts(calibration)) warnings.push_back(verdict);
  return warnings;
}

}  // namespace skullstation
