// How long the simulated camera takes for the 48 views of one pass.

#include <fmt/format.h>
#include <time.h>

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

#include "bench/seconds.h"
#include "capture/simulation/placement.h"
#include "capture/simulation/render.h"
#include "capture/simulation/sensor.h"
#include "core/file.h"
#include "core/parallel.h"
#include "core/session/image_file.h"
#include "reconstruction/io/ply.h"

namespace skullstation {
namespace {

struct Options {
  std::string specimen;
  std::string out;
  int views = 48;
  int threads = 0;
  double elevation_deg = 20.0;
  double first_angle_deg = 0.0;
  bool turned_over = false;
};

void print_row(const char* what, const Seconds& seconds, const char* reference) {
  fmt::print("{:<24} {:>10.2f} {:>14.2f} {:>14}\n", what, seconds.wall, seconds.processor,
             reference);
}

Result<void> run(const Options& options) {
  const auto mesh = read_ply(options.specimen);
  if (!mesh) return forward(mesh);
  const Rigid3 pose =
      rest_on_table(*mesh, options.turned_over ? turned_over() : Eigen::Quaterniond::Identity());

  const Seconds build_start = Seconds::now();
  const auto scene = SimulatedScene::build(*mesh, pose, SceneOptions{}, options.threads);
  if (!scene) return forward(scene);
  CameraOptics optics;
  optics.lens = Lens::from_params(1600, 1200, LensModel::opencv,
                                  {2800, 2800, 807.3, 596.1, -0.08, 0.05, 0.0004, -0.0003});
  optics.camera_from_station = camera_on_ring({0.0, 0.0, 95.0}, 650.0, options.elevation_deg);
  const auto prepared = PreparedOptics::prepare(optics, options.threads);
  if (!prepared) return forward(prepared);
  const Seconds build = Seconds::now() - build_start;

  Seconds render_all;
  for (int view = 0; view < options.views; ++view) {
    const double angle_deg = options.first_angle_deg + 360.0 * view / options.views;
    RenderOptions render;
    render.seed = static_cast<std::uint64_t>(view);
    render.threads = options.threads;
    const Seconds start = Seconds::now();
    const ImageF light = render_radiance(*(*scene)->placed(), *prepared, {&angle_deg, 1}, render);
    const Image8 photograph =
        develop(light, SensorOptions{}, ExposureSettings{}, render.seed, options.threads);
    render_all = render_all + (Seconds::now() - start);
    if (options.out.empty()) continue;
    const auto path = std::filesystem::path(options.out) / fmt::format("{:03}.png", view);
    if (const auto written = write_file_durably(path, encode_png(photograph)); !written) {
      return written;
    }
  }
  fmt::print("simulated camera, {} views of {}x{}, {} triangles, {} threads\n", options.views,
             optics.lens.width, optics.lens.height, mesh->triangles.rows(),
             thread_count(options.threads));
  const Seconds view = render_all * (1.0 / options.views);
  fmt::print("{:<24} {:>10} {:>14} {:>14}\n", "", "wall s", "processor s", "reference s");
  print_row("scene and optics", build, "");
  print_row("one view", view, "");
  print_row("48 views and scene", build + view * 48.0, "<= 120 wall");
  return {};
}

}  // namespace
}  // namespace skullstation

int main(int argc, char** argv) {
  skullstation::Options options;
  CLI::App app("Time of the simulated camera");
  app.add_option("--specimen", options.specimen, "PLY mesh in mm")->required();
  app.add_option("--out", options.out, "write the photographs to this folder, which must exist");
  app.add_option("--views", options.views, "views to render, evenly round the table")
      ->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "0: all");
  app.add_option("--elevation", options.elevation_deg, "of the camera [deg]");
  app.add_option("--first-angle", options.first_angle_deg, "of the table [deg]");
  app.add_flag("--turned-over", options.turned_over, "the specimen lies upside down");
  CLI11_PARSE(app, argc, argv);
  if (const auto done = skullstation::run(options); !done) {
    fmt::print(stderr, "{}\n", done.error().message());
    return skullstation::exit_code(done.error().kind);
  }
  return 0;
}
