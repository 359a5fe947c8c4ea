#pragma once

#include <chrono>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "capture/cameras/camera.h"
#include "capture/scan/image_quality.h"
#include "capture/scan/scan_plan.h"
#include "capture/simulation/simulated_camera.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "daemon/delivery/target_config.h"
#include "daemon/station/config_fields.h"
#include "firmware_io/gpio_station.h"
#include "firmware_io/simulated_station.h"
#include "firmware_io/turntable_config.h"

namespace skullstation {

enum class StationBackend { simulated, gpio };
enum class CameraBackend { simulated, v4l2, libcamera, replay };

/// Where a simulated camera stands, how it sees and what is wrong with it.
struct SimulatedView {
  double azimuth_deg = -90.0;  ///< -90 looks at the face of a specimen that faces -y
  double elevation_deg = 15.0;
  double distance_mm = 740.0;        ///< to a point 100 mm above the table, on the axis
  double focal_px_per_width = 1.75;  ///< focal length over image width
  double centre_offset_x_px = 7.3;   ///< of the principal point from the image centre
  double centre_offset_y_px = -3.9;
  double k1 = -0.08, k2 = 0.03, p1 = 0.0004, p2 = -0.0003;  ///< OPENCV's distortion
  SimulatedCameraFaults faults;
};

struct CameraConfig {
  std::string id = "cam0";
  CameraBackend backend = CameraBackend::simulated;
  std::string device;  ///< /dev/v4l/by-id/…, a libcamera id, a folder to replay
  int width = 1600;
  int height = 1200;
  std::string format;  ///< V4L2 four-character code; empty: the best that the device offers
  std::optional<double> focal_length_mm;  ///< for EXIF
  CameraSettings settings;
  std::optional<double> gain_steps_per_unit;  ///< V4l2CameraConfig
  SimulatedView simulated;
};

struct ScanConfig {
  int passes = 2;
  int views_per_ring = 24;
  PhotographFormat image_format = PhotographFormat::png;
  int jpeg_quality = 95;
  std::chrono::milliseconds settle_time{800};
  std::chrono::milliseconds frame_timeout{5000};
  int max_attempts = 3;
};

struct SimulationConfig {
  /// PLY file in mm, +z up, face towards -y; empty: the built-in synthetic skull.
  std::string specimen;
  int render_samples = 4;
  SimulatedFaults faults;
};

/// When skullstationd seals a case and puts it into the outbox.
enum class SealTime {
  approved,  ///< once an examiner has approved the result
  built,     ///< at once, at a station without an examiner
};

struct EvidenceConfig {
  std::string keys_folder = "keys";
  std::string audit_log;  ///< file; empty: none is kept
  SealTime seal = SealTime::approved;
  std::string time_stamp_url;  ///< empty: packages carry no time stamp
};

/// What `skullstation exhibit` says of whose things it shows.
struct MuseumConfig {
  std::string holder;
  std::string rights;
  std::string rights_url;
  std::string base_url;  ///< where exhibits are served; empty: no IIIF manifests
};

/// Where sealed packages go (docs/delivery.md).
struct DeliveryConfig {
  std::string folder = "outbox";
  std::vector<TargetConfig> targets;
};

/// Where skullstationd keeps cases, and for how long.
struct StorageConfig {
  std::string folder = "/var/lib/skullstation";
  /// After every delivery of a case was verified; 0: for ever.
  int keep_days = 0;
};

/// Where and how skullstationd shows its console.
struct HttpConfig {
  bool enabled = true;
  /// 127.0.0.1: this machine alone; 0.0.0.0: the network. Before set-up always this machine alone.
  std::string address = "127.0.0.1";
  int port = 8443;          ///< 0: a free one
  std::string certificate;  ///< PEM, the chain; empty: the station's own
  std::string key;          ///< PEM
  int idle_min = 60;        ///< a sign-in ends after so long without a request
  int sign_in_hours = 12;   ///< and after so long in any case
};

enum class JobQuality { draft, standard, fine };

/// How skullstationd makes models and faces of scans.
struct JobsConfig {
  JobQuality quality = JobQuality::standard;
  int memory_mib = 6144;
  int time_limit_min = 240;
};

/// The content of station.toml. What a file does not say keeps these defaults, which make a
/// simulated station with two cameras.
struct StationConfig {
  std::string station_id = "SIM-01";
  StationBackend backend = StationBackend::simulated;
  /// Folder of camera-<id>.json and table.json.
  std::string calibration_folder = "calibration";
  int calibration_valid_days = 90;
  /// While the station is idle; 0: cameras are looked at only when a scan begins.
  int camera_check_s = 60;
  TurntableConfig turntable;
  GpioStationConfig gpio;
  std::vector<CameraConfig> cameras = simulated_pair();
  bool has_board = true;
  CharucoBoard board;
  ScanConfig scan;
  QualityGates gates;
  SimulationConfig simulation;
  EvidenceConfig evidence;
  DeliveryConfig delivery;
  MuseumConfig museum;
  StorageConfig storage;
  JobsConfig jobs;
  HttpConfig http;

  static std::vector<CameraConfig> simulated_pair();
};

/// Every key of station.toml: its place, its default and its meaning.
void visit_config(StationConfig& config, ConfigFields& fields);

struct LoadedConfig {
  StationConfig config;
  std::map<std::string, std::string> origins;  ///< "turntable.backlash_deg" -> "station.toml:7"
  std::vector<Error> problems;                 ///< in the file's order; empty: all is well
};

/// Reads and validates. An empty path gives the defaults.
LoadedConfig load_config(const std::filesystem::path& file);

/// The same for who wants a usable configuration or the first problem.
Result<StationConfig> read_config(const std::filesystem::path& file);

}  // namespace skullstation
