#include "daemon/station/station_check.h"

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/timex.h>
#include <unistd.h>

#include <array>
#include <filesystem>

#include "capture/calibration/calibration_file.h"
#include "capture/cameras/v4l2_discovery.h"
#include "core/file.h"

namespace skullstation {

namespace {

void check_clock(Findings& findings) {
  timex state{};
  const bool synchronised = ::adjtimex(&state) != TIME_ERROR;
  if (synchronised) {
    findings.ok("clock", to_iso8601(SystemClock().utc_now()) + ", synchronised");
  } else {
    findings.warn("clock", to_iso8601(SystemClock().utc_now()) + ", not synchronised",
                  "evidence carries these times: enable systemd-timesyncd or chrony");
  }
}

void check_space(const StationConfig& config, const std::filesystem::path& cases,
                 Findings& findings) {
  const auto free = free_space_bytes(cases);
  if (!free) return findings.fail("disk", free.error());
  double scan_bytes = 0.0;
  for (const CameraConfig& camera : config.cameras) {
    // PNG of a photograph: about 60 % of the raw RGB; JPEG at high quality: about 15 %.
    const double share = config.scan.image_format == PhotographFormat::png ? 0.6 : 0.15;
    scan_bytes += share * 3.0 * camera.width * camera.height * config.scan.views_per_ring *
                  config.scan.passes;
  }
  const double scans = static_cast<double>(*free) / scan_bytes;
  const std::string what = fmt::format("{:.1f} GB free, about {:.0f} scans of {:.2f} GB",
                                       static_cast<double>(*free) * 1e-9, scans, scan_bytes * 1e-9);
  if (scans >= 20.0) return findings.ok("disk", what);
  findings.warn("disk", what, "make room before the next working day");
}

void check_stepping_priority(const StationConfig& config, Findings& findings) {
  if (config.backend != StationBackend::gpio) return;
  rlimit limit{};
  ::getrlimit(RLIMIT_RTPRIO, &limit);
  if (limit.rlim_cur > 0 || ::geteuid() == 0) {
    return findings.ok("stepping", "may run at real-time priority");
  }
  findings.warn("stepping", "may not run at real-time priority; motion will be less smooth",
                "give the user an rtprio limit (docs/hardware.md)");
}

void list_devices(Findings& findings) {
  for (const V4l2CameraInfo& camera : list_v4l2_cameras()) {
    if (camera.problem.empty()) {
      findings.ok("device",
                  fmt::format("{} {} ({})", camera.model, camera.serial, camera.stable_path));
    } else {
      findings.warn("device", fmt::format("{}: {}", camera.node, camera.problem), "");
    }
  }
}

void check_camera(const StationConfig& config, const StationCamera& camera, Clock& clock,
                  Findings& findings) {
  const std::string topic = "camera " + camera.config.id;
  const auto frame = camera.camera->frame_after(clock.now(), config.scan.frame_timeout, {});
  if (!frame) return findings.fail(topic, frame.error());
  if (frame->image.width != camera.config.width || frame->image.height != camera.config.height) {
    return findings.fail(
        topic, {ErrorKind::hardware, "",
                fmt::format("delivers {}x{} pixels, station.toml says {}x{}", frame->image.width,
                            frame->image.height, camera.config.width, camera.config.height),
                "correct width and height"});
  }
  findings.ok(topic, fmt::format("{}, {}", device_name(*camera.camera),
                                 camera.camera->description().format));
  for (const LockedSetting& setting : camera.locked) {
    if (setting.asked == setting.in_force) continue;
    findings.warn(
        topic,
        fmt::format("{} is {}, {} was asked for", setting.control, setting.in_force, setting.asked),
        "use a value that the device offers");
  }
  if (!camera.calibration) {
    return findings.warn(
        topic, "is not calibrated",
        fmt::format("run `skullstation calibrate camera --camera {}`", camera.config.id));
  }
  const auto warnings =
      calibration_warnings(*camera.calibration, device_name(*camera.camera), clock.utc_now(),
                           std::chrono::days(config.calibration_valid_days));
  for (const std::string& warning : warnings) {
    findings.warn(topic, warning,
                  fmt::format("run `skullstation calibrate camera --camera {}`", camera.config.id));
  }
  if (warnings.empty()) {
    findings.ok(topic, fmt::format("calibrated {}, {:.3f} px RMS", camera.calibration->created,
                                   camera.calibration->rms_px));
  }
}

void check_table_calibration(const StationConfig& config, const Clock& clock, Findings& findings) {
  const auto file = table_calibration_file(config);
  if (!std::filesystem::exists(file)) {
    return findings.warn("table", "is not calibrated", "run `skullstation calibrate table`");
  }
  const auto calibration = read_table_calibration(file);
  if (!calibration) return findings.fail("table", calibration.error());
  const auto warnings = calibration_warnings(*calibration, clock.utc_now(),
                                             std::chrono::days(config.calibration_valid_days));
  for (const std::string& warning : warnings) {
    findings.warn("table", warning, "run `skullstation calibrate table`");
  }
  if (warnings.empty()) {
    findings.ok("table", fmt::format("calibrated {}, wobble {:.2f} mm", calibration->created,
                                     calibration->wobble_mm));
  }
}

}  // namespace

const char* to_string(Verdict verdict) {
  constexpr std::array<const char*, 3> words{"ok", "warning", "failure"};
  return words[static_cast<std::size_t>(verdict)];
}

void check_machine(const StationConfig& config, const std::filesystem::path& cases,
                   Findings& findings) {
  check_clock(findings);
  check_space(config, cases, findings);
  check_stepping_priority(config, findings);
  list_devices(findings);
}

void check_parts(const StationConfig& config, const Station& station, Findings& findings) {
  if (station.hardware.interlock->tripped()) {
    findings.fail("interlock", {ErrorKind::hardware, "", station.hardware.interlock->reason(),
                                "release it and reset the station"});
  } else {
    findings.ok("hardware",
                config.backend == StationBackend::gpio ? "all GPIO lines found" : "simulated");
  }
  for (const StationCamera& camera : station.cameras) {
    check_camera(config, camera, *station.clock, findings);
  }
  check_table_calibration(config, *station.clock, findings);
}

}  // namespace skullstation
