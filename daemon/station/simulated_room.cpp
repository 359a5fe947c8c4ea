#include "daemon/station/simulated_room.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "capture/simulation/placement.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/random.h"
#include "core/units.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

namespace {

/// The cameras look at this point of the table's axis: about the middle of a standing skull.
const Eigen::Vector3d view_target_mm(0.0, 0.0, 100.0);

/// Streams of random numbers of one seed.
enum SeedOf : std::uint64_t {
  board_seed = 1,
  table_seed = 2,
  camera_seed = 3,
  placement_seed = 16
};

Result<TriangleMesh> load_specimen(const std::string& file, int threads) {
  if (file.empty()) return canonical_skull(1.0, threads);
  return read_ply(file);
}

Eigen::Quaterniond resting_orientation(int pass) {
  switch (pass) {
    case 0: return Eigen::Quaterniond::Identity();
    case 1: return turned_over();
    default:  // on its back, face up
      return Eigen::Quaterniond(Eigen::AngleAxisd(radians(-90.0), Eigen::Vector3d::UnitX()));
  }
}

}  // namespace

Lens simulated_lens(const CameraConfig& camera) {
  const SimulatedView& view = camera.simulated;
  Lens lens;
  lens.width = camera.width;
  lens.height = camera.height;
  lens.fx = lens.fy = view.focal_px_per_width * camera.width;
  lens.cx = 0.5 * camera.width + view.centre_offset_x_px;
  lens.cy = 0.5 * camera.height + view.centre_offset_y_px;
  lens.k1 = view.k1;
  lens.k2 = view.k2;
  lens.p1 = view.p1;
  lens.p2 = view.p2;
  return lens;
}

SimulatedRoom::SimulatedRoom(const StationConfig& config, Clock& clock, std::uint64_t seed,
                             int threads)
    : config_(config), clock_(clock), seed_(seed), threads_(threads) {}

Result<std::unique_ptr<SimulatedRoom>> SimulatedRoom::build(const StationConfig& config,
                                                            RoomSetting setting, Clock& clock,
                                                            std::uint64_t seed, int threads) {
  std::unique_ptr<SimulatedRoom> room(new SimulatedRoom(config, clock, seed, threads));
  if (const auto furnished = room->furnish(setting); !furnished) return forward(furnished);
  return room;
}

Result<void> SimulatedRoom::furnish(RoomSetting setting) {
  station_ = std::make_unique<SimulatedStation>(config_.turntable, config_.simulation.faults,
                                                clock_, mix(seed_, table_seed));
  std::optional<Rigid3> table_from_specimen;
  if (setting == RoomSetting::specimen_on_table) {
    auto specimen = load_specimen(config_.simulation.specimen, threads_);
    if (!specimen) return forward(specimen);
    if (specimen->triangles.rows() == 0) {
      return fail(ErrorKind::bad_input, config_.simulation.specimen,
                  "has no triangles to photograph");
    }
    specimen_ = *std::move(specimen);
    table_from_specimen = placement(0);
  }
  SceneOptions options;
  options.board = config_.has_board || setting == RoomSetting::board_in_hand
                      ? std::optional(config_.board)
                      : std::nullopt;
  options.platter = setting != RoomSetting::board_in_hand;
  options.bone.seed = seed_;
  Random random(mix(seed_, board_seed));
  options.table_from_board = rotation_about_z(random.normal(0.0, 0.5));
  options.table_from_board.translation = {random.normal(0.0, 1.5), random.normal(0.0, 1.5), 0.0};
  auto scene =
      SimulatedScene::build(specimen_, table_from_specimen.value_or(Rigid3{}), options, threads_);
  if (!scene) return forward(scene);
  scene_ = *std::move(scene);
  return {};
}

Rigid3 SimulatedRoom::placement(int pass) const {
  Random random(mix(seed_, placement_seed + static_cast<std::uint64_t>(pass)));
  Rigid3 hand = rotation_about_z(random.normal(0.0, 4.0));
  hand.translation = {random.normal(0.0, 3.0), random.normal(0.0, 3.0), 0.0};
  return hand * rest_on_table(specimen_, resting_orientation(pass));
}

CameraOptics SimulatedRoom::optics_of(const CameraConfig& camera) const {
  CameraOptics optics;
  optics.lens = simulated_lens(camera);
  optics.camera_from_station =
      camera_on_ring(view_target_mm, camera.simulated.distance_mm, camera.simulated.elevation_deg,
                     camera.simulated.azimuth_deg);
  optics.focus_distance_mm = camera.simulated.distance_mm;
  return optics;
}

std::uint64_t SimulatedRoom::index_of(const std::string& camera_id) const {
  const auto found = std::find_if(config_.cameras.begin(), config_.cameras.end(),
                                  [&](const CameraConfig& c) { return c.id == camera_id; });
  return static_cast<std::uint64_t>(found - config_.cameras.begin());
}

Result<std::unique_ptr<Camera>> SimulatedRoom::open_camera(const CameraConfig& camera) {
  SimulatedCameraOptions options;
  options.serial = "SIM-" + camera.id;
  options.optics = optics_of(camera);
  options.render.samples = config_.simulation.render_samples;
  for (int* more : {&options.render.samples_where_uneven, &options.render.samples_at_outlines}) {
    *more = std::max(*more, options.render.samples);
  }
  options.render.seed = mix(mix(seed_, camera_seed), index_of(camera.id));
  options.render.threads = threads_;
  options.faults = camera.simulated.faults;
  auto opened = SimulatedCamera::open(
      scene_, options, [this](Instant at) { return station_->true_table_angle_deg(at); }, clock_);
  if (!opened) return forward(opened);
  return std::unique_ptr<Camera>(*std::move(opened));
}

void SimulatedRoom::place_specimen(int pass) { scene_->set_specimen_pose(placement(pass)); }

void SimulatedRoom::hold_board(const CameraConfig& camera, const Rigid3& camera_from_board) {
  const Rigid3 station_from_board =
      optics_of(camera).camera_from_station.inverse() * camera_from_board;
  // The scene counts in the table's frame, and the table stands wherever it was left.
  const Rigid3 table_from_station = rotation_about_z(-station_->true_table_angle_deg(clock_.now()));
  scene_->set_board_pose(table_from_station * station_from_board);
}

void SimulatedRoom::note_truth(const std::string& image, int pass) {
  noted_[image] = {pass, wrapped_deg(station_->true_table_angle_deg(clock_.now()))};
}

Result<void> SimulatedRoom::write_truth(const std::filesystem::path& file) const {
  using Json = nlohmann::ordered_json;
  Json views = Json::object();
  Json placements = Json::object();
  if (std::filesystem::exists(file)) {  // an interrupted scan goes on
    const auto bytes = read_file(file);
    if (!bytes) return forward(bytes);
    const Json earlier = Json::parse(*bytes, nullptr, false);
    if (earlier.is_discarded() || !earlier.contains("views") || !earlier.contains("passes")) {
      return fail(ErrorKind::bad_input, file.string(), "is not a simulation's truth",
                  "remove it; it is written anew");
    }
    views = earlier["views"];
    placements = earlier["passes"];
  }
  for (const auto& [image, view] : noted_) {
    views[image] = {{"pass", view.pass}, {"table_angle_deg", view.table_angle_deg}};
    placements[std::to_string(view.pass)] = {
        {"table_from_specimen", matrix_rows(placement(view.pass).matrix())}};
  }
  Json cameras = Json::array();
  for (const CameraConfig& camera : config_.cameras) {
    if (camera.backend != CameraBackend::simulated) continue;
    const CameraOptics optics = optics_of(camera);
    cameras.push_back({{"id", camera.id},
                       {"model", to_string(LensModel::opencv)},
                       {"params", optics.lens.params(LensModel::opencv)},
                       {"camera_from_station", matrix_rows(optics.camera_from_station.matrix())}});
  }
  const Json truth = {{"format", "skullstation-simulation-truth/1"},
                      {"specimen", config_.simulation.specimen},
                      {"table_from_board", matrix_rows(scene_->board_pose().matrix())},
                      {"cameras", cameras},
                      {"passes", placements},
                      {"views", views}};
  return write_file_durably(file, truth.dump(1) + "\n");
}

}  // namespace skullstation
