#include "capture/simulation/scene.h"

#include <fmt/format.h>

#include <mutex>
#include <utility>

#include "capture/simulation/placed_scene.h"

namespace skullstation {

namespace {

/// Small enough for ambient light and creases, large enough to leave scans as they are.
constexpr double longest_edge_mm = 3.0;
constexpr int most_triangles = 3'000'000;

tl::unexpected<Error> bad_option(const char* option, const std::string& what) {
  return fail(ErrorKind::bad_input, fmt::format("simulated scene, {}", option), what);
}

void put_board(PlacedScene& scene, const Rigid3& table_from_board) {
  scene.table_from_board = table_from_board;
  scene.board_rotation_table = table_from_board.rotation.conjugate().toRotationMatrix();
}

}  // namespace

std::vector<SoftBox> SceneOptions::default_lights() {
  const Eigen::Vector3d target(0.0, 0.0, 80.0);
  return {{{-620.0, -640.0, 720.0}, target, 500.0, 500.0, 0.50},
          {{760.0, -380.0, 560.0}, target, 600.0, 600.0, 0.30}};
}

Result<void> SceneOptions::validate() const {
  if (board) {
    if (const auto sound = board->validate(); !sound) return sound;
  }
  if (!(board_border_mm >= 0.0)) return bad_option("board_border_mm", "must not be negative");
  if (!(board_thickness_mm > 0.0)) return bad_option("board_thickness_mm", "must be positive");
  if (!(platter_radius_mm > 0.0)) return bad_option("platter_radius_mm", "must be positive");
  if (!(platter_thickness_mm > 0.0)) return bad_option("platter_thickness_mm", "must be positive");
  if (!(ambient >= 0.0)) return bad_option("ambient", "must not be negative");
  if (!(gloss >= 0.0)) return bad_option("gloss", "must not be negative");
  if (ambient_rays < 1 || ambient_rays > SampleTable::points) {
    return bad_option("ambient_rays", fmt::format("must be 1 to {}", SampleTable::points));
  }
  if (lights.size() > 8) return bad_option("lights", "must be 8 at most");
  for (const SoftBox& light : lights) {
    if (!(light.width_mm > 0.0 && light.height_mm > 0.0 && light.strength >= 0.0) ||
        !((light.centre_mm - light.target_mm).norm() > 0.0)) {
      return bad_option("lights", "each needs a positive size, a strength and a target elsewhere");
    }
  }
  return {};
}

struct SimulatedScene::State {
  int threads = 0;
  mutable std::mutex mutex;
  std::shared_ptr<const PlacedScene> placed;
};

SimulatedScene::SimulatedScene(std::unique_ptr<State> state) : state_(std::move(state)) {}
SimulatedScene::~SimulatedScene() = default;

Result<std::shared_ptr<SimulatedScene>> SimulatedScene::build(const TriangleMesh& specimen,
                                                              const Rigid3& table_from_specimen,
                                                              const SceneOptions& options,
                                                              int threads) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  auto mesh = make_shading_mesh(specimen, longest_edge_mm, most_triangles);
  if (!mesh) return forward(mesh);
  const bool bare = specimen.triangles.rows() == 0;
  std::shared_ptr<const SpecimenSurface> surface;
  if (!bare) {
    auto built = SpecimenSurface::build(*std::move(mesh));
    if (!built) return forward(built);
    surface = *std::move(built);
  }
  std::optional<BoardPrint> print;
  if (options.board) print.emplace(*options.board);
  auto placed = std::make_shared<PlacedScene>();
  placed->parts = std::make_shared<const SceneParts>(
      SceneParts{options, std::move(surface), BoneTexture(options.bone, bounding_box(specimen)),
                 std::move(print), SampleTable(options.bone.seed), Backdrop()});
  put_board(*placed, options.table_from_board);
  if (!bare) placed->table_from_specimen = table_from_specimen;
  compute_ambient(*placed, threads);

  auto state = std::make_unique<State>();
  state->threads = threads;
  state->placed = std::move(placed);
  return std::shared_ptr<SimulatedScene>(new SimulatedScene(std::move(state)));
}

void SimulatedScene::set_specimen_pose(const std::optional<Rigid3>& table_from_specimen) {
  auto changed = std::make_shared<PlacedScene>(*placed());
  changed->table_from_specimen =
      changed->parts->surface ? table_from_specimen : std::optional<Rigid3>();
  compute_ambient(*changed, state_->threads);
  const std::lock_guard lock(state_->mutex);
  // Whoever moved the board in the meantime is not to be undone.
  put_board(*changed, state_->placed->table_from_board);
  state_->placed = std::move(changed);
}

void SimulatedScene::set_board_pose(const Rigid3& table_from_board) {
  const std::lock_guard lock(state_->mutex);
  auto changed = std::make_shared<PlacedScene>(*state_->placed);
  put_board(*changed, table_from_board);
  state_->placed = std::move(changed);
}

std::optional<Rigid3> SimulatedScene::specimen_pose() const {
  return placed()->table_from_specimen;
}

Rigid3 SimulatedScene::board_pose() const { return placed()->table_from_board; }

std::shared_ptr<const PlacedScene> SimulatedScene::placed() const {
  const std::lock_guard lock(state_->mutex);
  return state_->placed;
}

}  // namespace skullstation
