#include "daemon/station/station_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "daemon/station/config_toml.h"

namespace skullstation {

namespace {

void visit_turntable(TurntableConfig& turntable, ConfigFields& fields) {
  MotionLimits& limits = turntable.limits;
  fields.field("steps_per_turn", limits.steps_per_turn,
               "microsteps for one turn of the platter, gears included");
  fields.field("max_speed_deg_s", limits.max_speed_deg_s, "of the platter");
  fields.field("max_acceleration_deg_s2", limits.max_acceleration_deg_s2, "of the platter");
  fields.field("max_jerk_deg_s3", limits.max_jerk_deg_s3, "a tall skull must not rock");
  fields.field("reversed", turntable.reversed, "high level of the DIR line turns clockwise");
  fields.field("backlash_deg", turntable.backlash_deg,
               "overshoot before the final counter-clockwise approach");
  fields.field("home_speed_deg_s", turntable.home_speed_deg_s, "looking for the index switch");
  fields.field("home_search_deg", turntable.home_search_deg,
               "turn after which the index switch counts as missing");
  fields.field("home_offset_deg", turntable.home_offset_deg, "from the switch's edge to zero");
  fields.field("release_when_idle", turntable.release_when_idle, "motor current off after a scan");
  fields.field("holds_without_current", turntable.holds_without_current,
               "the gear keeps the position without current");
}

void visit_board(CharucoBoard& board, ConfigFields& fields) {
  fields.field("dictionary", board.dictionary, "of OpenCV's ArUco markers");
  fields.field("squares_x", board.squares_x, "squares along the page's x");
  fields.field("squares_y", board.squares_y, "squares along the page's y");
  fields.field("square_mm", board.square_mm, "edge of a square: MEASURE the print");
  fields.field("marker_mm", board.marker_mm, "edge of a marker");
}

void visit_scan(ScanConfig& scan, ConfigFields& fields) {
  fields.field("passes", scan.passes, "placements: upright, turned over, on its back");
  fields.field("views_per_ring", scan.views_per_ring, "pictures per camera and pass");
  fields.field("image_format", scan.image_format, {"png", "jpeg"}, "of the images");
  fields.field("jpeg_quality", scan.jpeg_quality, "1 to 100");
  fields.field("settle_ms", scan.settle_time, "from the end of a move to the first light");
  fields.field("frame_timeout_ms", scan.frame_timeout, "a camera that needs longer has failed");
  fields.field("max_attempts", scan.max_attempts, "per view, before it is recorded as rejected");
}

void visit_gates(QualityGates& gates, ConfigFields& fields) {
  fields.field("min_sharpness", gates.min_sharpness, "absolute floor");
  fields.field("min_sharpness_of_median", gates.min_sharpness_of_median,
               "of the median of the camera's accepted views");
  fields.field("views_for_median", gates.views_for_median, "before the median counts");
  fields.field("max_clipped_percent", gates.max_clipped_percent, "specimen's pixels at 255");
  fields.field("max_dark_percent", gates.max_dark_percent, "specimen's pixels that are black");
  fields.field("min_mean_level", gates.min_mean_level, "of the specimen, 0 to 255");
  fields.field("max_mean_level", gates.max_mean_level, "of the specimen, 0 to 255");
  fields.field("max_motion_px", gates.max_motion_px, "between two frames after settling");
  fields.field("max_border_percent", gates.max_border_percent,
               "frame's border that the specimen touches");
  fields.field("min_specimen_percent", gates.min_specimen_percent, "less is an empty table");
  fields.field("min_board_corners", gates.min_board_corners, "of the board in view");
}

void visit_simulated_view(SimulatedView& view, ConfigFields& fields) {
  fields.field("azimuth_deg", view.azimuth_deg, "direction seen from the axis; -90: the face");
  fields.field("elevation_deg", view.elevation_deg, "above the table");
  fields.field("distance_mm", view.distance_mm, "to the middle of the specimen");
  fields.field("focal_px_per_width", view.focal_px_per_width, "focal length / image width");
  fields.field("centre_offset_x_px", view.centre_offset_x_px, "principal point off the centre");
  fields.field("centre_offset_y_px", view.centre_offset_y_px, "principal point off the centre");
  fields.field("k1", view.k1, "radial distortion");
  fields.field("k2", view.k2, "radial distortion");
  fields.field("p1", view.p1, "tangential distortion");
  fields.field("p2", view.p2, "tangential distortion");
  SimulatedCameraFaults& faults = view.faults;
  fields.field("dead", faults.dead, "fault: not there");
  fields.field("unplugged_after_frames", faults.unplugged_after_frames, "fault: cable comes off");
  fields.field("silent", faults.silent, "fault: no frame ever arrives");
  fields.field("times_out_every_nth", faults.times_out_every_nth, "fault: a frame is late");
  fields.field("drops_every_nth", faults.drops_every_nth, "fault: a frame is lost");
  fields.field("corrupt_every_nth", faults.corrupt_every_nth, "fault: a frame is damaged");
  fields.field("overexposed", faults.overexposed, "fault: too much light");
  fields.field("ignores_exposure", faults.ignores_exposure, "fault: keeps its exposure");
}

void visit_camera(CameraConfig& camera, ConfigFields& fields) {
  fields.field("id", camera.id, "name in sessions and calibration files");
  fields.field("backend", camera.backend, {"simulated", "v4l2", "libcamera", "replay"},
               "how it is driven");
  fields.field("device", camera.device,
               "/dev/v4l/by-id/..., libcamera's id, or the folder to replay");
  fields.field("width", camera.width, "pixels");
  fields.field("height", camera.height, "pixels");
  fields.field("format", camera.format, "V4L2 four-character code; empty: the best offered");
  fields.field("focal_length_mm", camera.focal_length_mm, "of the lens, for EXIF");
  fields.field("exposure_us", camera.settings.exposure, "locked for the scan");
  fields.field("gain", camera.settings.gain, "locked for the scan; 1: none");
  fields.field("white_balance_k", camera.settings.white_balance_k, "locked for the scan");
  fields.field("focus", camera.settings.focus, "locked for the scan; 0 far to 1 near");
  fields.field("gain_steps_per_unit", camera.gain_steps_per_unit,
               "V4L2: steps of the device's gain control that raise the gain by 1");
  fields.table("simulated", [&] { visit_simulated_view(camera.simulated, fields); });
}

void visit_gpio(GpioStationConfig& gpio, ConfigFields& fields) {
  fields.field("chip", gpio.chip, "name, label or path; empty: every chip is searched");
  fields.field("step_pulse_us", gpio.step_pulse, "high time of a step pulse");
  fields.field("debounce_ms", gpio.button_timing.debounce, "of the button; never of the stop");
  fields.field("held_after_ms", gpio.button_timing.held_after, "a press this long cancels");
  const auto wire = [&](std::string_view key, GpioWire& w) {
    fields.table(key, [&] {
      fields.field("line", w.name, "as `gpioinfo` lists it; empty: not fitted");
      fields.field("active_low", w.active_low, "active at the low level");
      fields.field("bias", w.bias, {"as_wired", "pull_up", "pull_down"}, "of an input");
    });
  };
  wire("step", gpio.step);
  wire("direction", gpio.direction);
  wire("enable", gpio.enable);
  wire("home", gpio.home);
  wire("estop", gpio.estop);
  wire("door", gpio.door);
  wire("button", gpio.button);
  wire("green", gpio.green);
  wire("yellow", gpio.yellow);
  wire("red", gpio.red);
  wire("buzzer", gpio.buzzer);
  wire("lights", gpio.lights);
}

void visit_simulation(SimulationConfig& simulation, ConfigFields& fields) {
  fields.field("specimen", simulation.specimen,
               "PLY file, mm, +z up, face towards -y; empty: a synthetic skull");
  fields.field("render_samples", simulation.render_samples, "rays per pixel");
  SimulatedFaults& faults = simulation.faults;
  fields.field("slip_fraction", faults.slip_fraction, "fault: part of every turn that is lost");
  fields.field("stall_at_deg", faults.stall_at_deg, "fault: the platter sticks");
  fields.field("index_switch_missing", faults.index_switch_missing, "fault: homing finds nothing");
  fields.field("button_bounces", faults.button_bounces, "fault: each edge comes as a burst");
  fields.field("estop_after_turn_deg", faults.estop_after_turn_deg, "fault: someone hits the stop");
  fields.field("estop_stuck", faults.estop_stuck, "fault: the stop can't be reset");
}

void visit_target(TargetConfig& target, ConfigFields& fields) {
  fields.field("name", target.name, "of the receiver in the outbox");
  fields.field("protocol", target.protocol,
               {"folder", "webdav", "s3", "sftp", "dicom", "stow", "fhir"}, "how it is spoken to");
  fields.field("address", target.address,
               "absolute path, or URL: https://, sftp://, dicoms:// without user and password");
  fields.field("enabled", target.enabled, "false: nothing is sent to it for now");
  fields.field("hours", target.hours, "UTC, like 20:00-06:00, when it is sent to; empty: always");
  fields.field("user", target.user, "who logs in; s3: the access key's id");
  fields.field("secret", target.secret,
               "WHERE the password, token or key is: a systemd credential's name or the path of a "
               "file that nobody else may read");
  fields.field("ca_file", target.ca_file, "PEM: who vouches for it; empty: the system's list");
  fields.field("certificate_file", target.certificate_file, "PEM: this station's own");
  fields.field("key_file", target.key_file, "PEM: the key of it; sftp: the key to log in with");
  fields.field("host_key_sha256", target.host_key_sha256, "sftp: SHA256:... of its host key");
  fields.field("region", target.region, "s3");
  fields.field("called_ae", target.called_ae, "dicom: its AE title");
  fields.field("calling_ae", target.calling_ae, "dicom: this station's AE title");
  fields.field("mounted", target.mounted, "folder: must be a mounted file system");
  fields.field("max_photographs", target.max_photographs, "dicom, stow: unset: all are sent");
}

/// Finds the line that set the key a validation complains about, if a file did.
Error with_origin(Error error, const std::map<std::string, std::string>& origins) {
  const auto origin = origins.find(error.where);
  if (origin == origins.end()) return error;
  error.what = error.where + " " + error.what;
  error.where = origin->second;
  return error;
}

/// Everything that each part can tell about itself, and how the parts fit together.
std::vector<Error> invalid_values(const StationConfig& config) {
  std::vector<Error> problems;
  const auto check = [&](const std::string& table, const Result<void>& valid) {
    if (valid) return;
    Error error = valid.error();
    error.where = error.where.empty() ? table : fmt::format("{}.{}", table, error.where);
    problems.push_back(std::move(error));
  };
  const auto complain = [&](std::string key, std::string what, std::string advice = {}) {
    problems.push_back({ErrorKind::bad_input, std::move(key), std::move(what), std::move(advice)});
  };
  check("turntable", config.turntable.validate());
  if (config.has_board) check("board", config.board.validate());
  check("gates", config.gates.validate());
  if (config.backend == StationBackend::gpio) check("gpio", config.gpio.validate());
  if (config.cameras.empty()) complain("camera", "a station needs at least one [[camera]]");
  std::set<std::string> ids;
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    const CameraConfig& camera = config.cameras[i];
    const std::string key = fmt::format("camera[{}]", i);
    const bool good_id =
        !camera.id.empty() && std::all_of(camera.id.begin(), camera.id.end(), [](unsigned char c) {
          return std::isalnum(c) != 0 || c == '-' || c == '_';
        });
    if (!good_id) complain(key + ".id", "must be letters, digits, - and _ only");
    if (!ids.insert(camera.id).second) {
      complain(key + ".id", fmt::format("\"{}\" is used twice", camera.id));
    }
    if (camera.width < 64 || camera.width > 20000 || camera.height < 64 || camera.height > 20000) {
      complain(key + ".width", "and height must lie within 64 and 20000 pixels");
    }
    if (camera.backend != CameraBackend::simulated && camera.device.empty()) {
      complain(key + ".device", "must name the device",
               "`skullstation doctor` lists the cameras that are there");
    }
    if (camera.backend == CameraBackend::simulated && config.backend == StationBackend::gpio) {
      complain(key + ".backend", "a simulated camera needs station.backend = \"simulated\"");
    }
  }
  if (config.calibration_valid_days < 1) {
    complain("station.calibration_valid_days", "must be at least 1");
  }
  if (config.camera_check_s < 0) complain("station.camera_check_s", "must be 0 or more");
  if (config.delivery.folder.empty()) complain("delivery.folder", "must name a folder");
  std::set<std::string> targets;
  for (std::size_t i = 0; i < config.delivery.targets.size(); ++i) {
    const TargetConfig& target = config.delivery.targets[i];
    const std::string key = fmt::format("delivery.targets[{}]", i);
    check(key, target.validate());
    if (!targets.insert(target.name).second) {
      complain(key + ".name", fmt::format("\"{}\" is used twice", target.name));
    }
  }
  for (const auto& [key, url] :
       {std::pair("museum.rights_url", config.museum.rights_url),
        std::pair("museum.base_url", config.museum.base_url),
        std::pair("evidence.time_stamp_url", config.evidence.time_stamp_url)}) {
    if (!url.empty() && !url.starts_with("https://") && !url.starts_with("http://")) {
      complain(key, "must be an address that begins with https:// or http://");
    }
  }
  if (config.storage.folder.empty()) complain("storage.folder", "must name a folder");
  if (config.storage.keep_days < 0) complain("storage.keep_days", "must be 0 or more");
  if (config.jobs.memory_mib < 256) complain("jobs.memory_mib", "must be at least 256");
  if (config.jobs.time_limit_min < 1) complain("jobs.time_limit_min", "must be at least 1");
  const HttpConfig& http = config.http;
  if (http.port < 0 || http.port > 65535) complain("http.port", "must be 0 to 65535");
  if (http.idle_min < 1) complain("http.idle_min", "must be at least 1");
  if (http.sign_in_hours < 1) complain("http.sign_in_hours", "must be at least 1");
  if (http.certificate.empty() != http.key.empty()) {
    complain("http.certificate", "and http.key come together",
             "name both files, or neither for the station's own certificate");
  }
  if (config.scan.passes < 1 || config.scan.passes > 3) complain("scan.passes", "must be 1 to 3");
  if (config.scan.jpeg_quality < 1 || config.scan.jpeg_quality > 100) {
    complain("scan.jpeg_quality", "must be 1 to 100");
  }
  if (config.scan.views_per_ring < 1 || config.scan.views_per_ring > 720) {
    complain("scan.views_per_ring", "must be 1 to 720");
  }
  return problems;
}

}  // namespace

std::vector<CameraConfig> StationConfig::simulated_pair() {
  CameraConfig low;
  low.id = "cam0";
  low.simulated.elevation_deg = 15.0;
  CameraConfig high;
  high.id = "cam1";
  high.simulated.elevation_deg = 45.0;
  high.simulated.azimuth_deg = -82.5;  // half a step off: the two rings interleave
  return {low, high};
}

void visit_config(StationConfig& config, ConfigFields& fields) {
  fields.table("station", [&] {
    fields.field("id", config.station_id, "name of this station in sessions and reports");
    fields.field("backend", config.backend, {"simulated", "gpio"}, "what drives the hardware");
    fields.field("calibration_folder", config.calibration_folder, "of calibration files");
    fields.field("calibration_valid_days", config.calibration_valid_days,
                 "older ones are reported as stale");
    fields.field("camera_check_s", config.camera_check_s,
                 "between two looks at idle cameras; 0: never");
  });
  fields.table("turntable", [&] { visit_turntable(config.turntable, fields); });
  fields.table("gpio", [&] { visit_gpio(config.gpio, fields); });
  fields.tables(
      "camera", config.cameras.size(),
      [&](std::size_t count) { config.cameras.assign(count, CameraConfig{}); },
      [&](std::size_t i) { visit_camera(config.cameras[i], fields); });
  fields.table("board", [&] {
    fields.field("present", config.has_board, "a ChArUco board lies on the table");
    visit_board(config.board, fields);
  });
  fields.table("scan", [&] { visit_scan(config.scan, fields); });
  fields.table("gates", [&] { visit_gates(config.gates, fields); });
  fields.table("simulation", [&] { visit_simulation(config.simulation, fields); });
  fields.table("evidence", [&] {
    fields.field("keys_folder", config.evidence.keys_folder,
                 "what packages and the audit log are signed with (skullstation keys create)");
    fields.field("audit_log", config.evidence.audit_log,
                 "file of the station's audit log; empty: none is kept");
    fields.field("seal", config.evidence.seal, {"approved", "built"},
                 "when skullstationd seals and delivers a case: once it is approved, or at once");
    fields.field("time_stamp_url", config.evidence.time_stamp_url,
                 "RFC 3161 authority that stamps every package; empty: none");
  });
  fields.table("delivery", [&] {
    fields.field("folder", config.delivery.folder, "of the outbox");
    fields.tables(
        "targets", config.delivery.targets.size(),
        [&](std::size_t count) { config.delivery.targets.assign(count, TargetConfig{}); },
        [&](std::size_t i) { visit_target(config.delivery.targets[i], fields); });
  });
  fields.table("museum", [&] {
    fields.field("holder", config.museum.holder, "institution that exhibits name");
    fields.field("rights", config.museum.rights, "sentence in every exhibited model");
    fields.field("rights_url", config.museum.rights_url,
                 "licence: an address at creativecommons.org or rightsstatements.org");
    fields.field("base_url", config.museum.base_url,
                 "https address of the folder that exhibits are served from; empty: no IIIF "
                 "manifests");
  });
  fields.table("storage", [&] {
    fields.field("folder", config.storage.folder, "where skullstationd keeps its cases");
    fields.field("keep_days", config.storage.keep_days,
                 "after verified delivery, until a case's files are deleted; 0: for ever");
  });
  fields.table("jobs", [&] {
    fields.field("quality", config.jobs.quality, {"draft", "standard", "fine"},
                 "of skullstationd's models");
    fields.field("memory_mib", config.jobs.memory_mib, "that a step may use");
    fields.field("time_limit_min", config.jobs.time_limit_min, "after which a step is ended");
  });
  fields.table("http", [&] {
    fields.field("enabled", config.http.enabled, "skullstationd shows its console");
    fields.field("address", config.http.address, "127.0.0.1: this machine alone; 0.0.0.0: network");
    fields.field("port", config.http.port, "of the console; 0: a free one");
    fields.field("certificate", config.http.certificate, "PEM file; empty: the station's own");
    fields.field("key", config.http.key, "PEM file of the certificate's key");
    fields.field("idle_min", config.http.idle_min, "without a request, until a sign-in ends");
    fields.field("sign_in_hours", config.http.sign_in_hours, "until a sign-in ends in any case");
  });
}

LoadedConfig load_config(const std::filesystem::path& file) {
  LoadedConfig loaded;
  if (!file.empty()) {
    TomlReading reading =
        read_toml(file, [&](ConfigFields& fields) { visit_config(loaded.config, fields); });
    loaded.origins = std::move(reading.origins);
    loaded.problems = std::move(reading.problems);
  }
  for (Error& problem : invalid_values(loaded.config)) {
    loaded.problems.push_back(with_origin(std::move(problem), loaded.origins));
  }
  return loaded;
}

Result<StationConfig> read_config(const std::filesystem::path& file) {
  LoadedConfig loaded = load_config(file);
  if (loaded.problems.empty()) return std::move(loaded.config);
  Error error = loaded.problems.front();
  if (loaded.problems.size() > 1) {
    error.advice =
        fmt::format("{}{}and {} more: `skullstation config check {}` lists all", error.advice,
                    error.advice.empty() ? "" : "; ", loaded.problems.size() - 1, file.string());
  }
  return tl::unexpected(std::move(error));
}

}  // namespace skullstation
