#include "bench/photogrammetry/simulation_truth.h"

#include <nlohmann/json.hpp>

#include "core/file.h"

namespace skullstation {

namespace {

Rigid3 rigid_of(const nlohmann::json& rows) {
  Eigen::Matrix<double, 3, 4> matrix;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 4; ++c)
      matrix(r, c) = rows[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  }
  return Rigid3::from_matrix(matrix);
}

}  // namespace

Rigid3 SimulationTruth::reconstruction_from_specimen() const {
  return Rigid3{table_from_board.rotation.conjugate(), {0.0, 0.0, 0.0}} * table_from_specimen;
}

Result<SimulationTruth> read_simulation_truth(const std::filesystem::path& session) {
  const auto bytes = read_file(session / "simulation_truth.json");
  if (!bytes) return forward(bytes);
  const auto json = nlohmann::json::parse(*bytes);
  SimulationTruth truth;
  truth.table_from_board = rigid_of(json["table_from_board"]);
  truth.table_from_specimen = rigid_of(json["passes"]["0"]["table_from_specimen"]);
  for (const auto& camera : json["cameras"]) {
    truth.camera_from_station[camera["id"]] = rigid_of(camera["camera_from_station"]);
  }
  for (const auto& [image, view] : json["views"].items()) {
    truth.table_angle_deg[image] = view["table_angle_deg"];
  }
  return truth;
}

}  // namespace skullstation
