#include "tests/e2e/small_station.h"

#include <fmt/format.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "core/file.h"
#include "reconstruction/io/ply.h"
#include "tests/support/process.h"

namespace skullstation::testing {

namespace {

/// A pear of about a skull's size: 130 x 160 x 140 mm, +z up.
TriangleMesh pear() {
  constexpr int rings = 40;
  constexpr int sectors = 64;
  TriangleMesh mesh;
  mesh.vertices.resize(rings * sectors + 2, 3);
  for (int r = 0; r < rings; ++r) {
    const double polar = std::numbers::pi * (r + 1) / (rings + 1);
    const double girth = 1.0 + 0.15 * std::cos(polar);
    for (int s = 0; s < sectors; ++s) {
      const double around = 2.0 * std::numbers::pi * s / sectors;
      mesh.vertices.row(r * sectors + s) << 65.0 * girth * std::sin(polar) * std::cos(around),
          80.0 * girth * std::sin(polar) * std::sin(around), 70.0 * std::cos(polar);
    }
  }
  const int top = rings * sectors;
  const int bottom = top + 1;
  mesh.vertices.row(top) << 0, 0, 70;
  mesh.vertices.row(bottom) << 0, 0, -70;
  mesh.triangles.resize(2 * sectors * rings, 3);
  int row = 0;
  for (int s = 0; s < sectors; ++s) {
    const int next = (s + 1) % sectors;
    mesh.triangles.row(row++) << top, s, next;
    mesh.triangles.row(row++) << bottom, (rings - 1) * sectors + next, (rings - 1) * sectors + s;
    for (int r = 0; r + 1 < rings; ++r) {
      const int a = r * sectors + s;
      const int b = r * sectors + next;
      mesh.triangles.row(row++) << a, a + sectors, b;
      mesh.triangles.row(row++) << b, a + sectors, b + sectors;
    }
  }
  return mesh;
}

std::string camera_toml(const char* id, double elevation_deg, const std::string& more) {
  return fmt::format(
      "[[camera]]\nid = \"{}\"\nwidth = 320\nheight = 240\n[camera.simulated]\n"
      "elevation_deg = {}\nazimuth_deg = -90\n{}\n",
      id, elevation_deg, more);
}

}  // namespace

std::filesystem::path write_small_station(const std::filesystem::path& folder,
                                          const SmallStation& station) {
  const auto specimen = folder / "specimen.ply";
  const auto file = folder / "station.toml";
  const std::string toml = fmt::format(
      "[station]\nid = \"TEST\"\ncalibration_folder = \"{}\"\n\n{}{}\n"
      "[board]\nsquares_x = 8\nsquares_y = 8\nsquare_mm = 43.75\nmarker_mm = 33\n\n"
      "[scan]\npasses = {}\nviews_per_ring = {}\n\n"
      // The gates were made for photographs, not for stamps of this size.
      "[gates]\nmin_board_corners = 0\nmax_border_percent = 100\nmax_motion_px = 5\n"
      "min_sharpness = 0\nmin_sharpness_of_median = 0\n\n"
      "[simulation]\nspecimen = \"{}\"\nrender_samples = 1\n{}\n{}\n",
      (folder / "calibration").string(), camera_toml("cam0", 20.0, station.camera),
      camera_toml("cam1", 50.0, ""), station.passes, station.views_per_ring, specimen.string(),
      station.simulation, station.extra);
  if (!write_ply(pear(), specimen) || !write_file_durably(file, toml)) {
    throw std::runtime_error("can't write " + file.string());
  }
  return file;
}

std::filesystem::path write_quick_station(const std::filesystem::path& folder,
                                          const std::string& camera, const std::string& station,
                                          const std::string& extra) {
  SmallStation small;
  small.views_per_ring = 2;
  small.camera = camera;
  small.extra =
      "[turntable]\nsteps_per_turn = 200\nmax_speed_deg_s = 1000\n"
      "max_acceleration_deg_s2 = 20000\nmax_jerk_deg_s3 = 2000000\nhome_speed_deg_s = 700\n" +
      extra;
  const auto file = write_small_station(folder, small);
  auto text = read_file(file).value_or("");
  text.insert(text.find("[scan]\n") + 7, "settle_ms = 0\n");
  text.insert(text.find("[station]\n") + 10, station);
  if (!write_file_durably(file, text)) throw std::runtime_error("can't write " + file.string());
  return file;
}

std::vector<std::string> daemon_command(const std::filesystem::path& config,
                                        const std::filesystem::path& storage) {
  const auto bin = skullstation_program().parent_path();
  return {(bin / "skullstationd").string(),
          "--config",
          config.string(),
          "--storage",
          storage.string(),
          "--step-program",
          (bin / "fake_step").string()};
}

}  // namespace skullstation::testing
