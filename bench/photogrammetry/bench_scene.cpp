#include "bench/photogrammetry/bench_scene.h"

#include <fmt/format.h>

#include "capture/simulation/placement.h"
#include "capture/simulation/render.h"
#include "capture/simulation/scene.h"
#include "capture/simulation/sensor.h"
#include "core/file.h"
#include "core/random.h"
#include "core/session/image_file.h"
#include "core/session/session.h"
#include "core/units.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

namespace {

namespace fs = std::filesystem;

struct Ring {
  const char* camera;
  double elevation_deg;
  double azimuth_deg;
};
constexpr Ring kRings[] = {{"cam0", 15.0, -90.0}, {"cam1", 45.0, -82.5}};
constexpr double kDistance_mm = 740.0;

Lens ring_lens(const BenchScene& scene) {
  const double f = 1.75 * scene.width;
  const double scale = scene.width / 1600.0;
  return Lens::from_params(scene.width, scene.height, LensModel::opencv,
                           {f, f, 0.5 * scene.width + 7.3 * scale, 0.5 * scene.height - 3.9 * scale,
                            -0.08, 0.03, 0.0004, -0.0003});
}

TriangleMesh placed(TriangleMesh mesh, const Rigid3& table_from_specimen) {
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    mesh.vertices.row(i) = (table_from_specimen * mesh.vertices.row(i).transpose()).transpose();
  }
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

Image8 specimen_mask(const ViewTruth& truth) {
  Image8 mask(truth.object.width, truth.object.height, 1);
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    mask.pixels[i] = truth.object.pixels[i] == static_cast<int>(SceneObject::specimen) ? 255 : 0;
  }
  return mask;
}

Result<void> render(const BenchScene& wanted, const fs::path& folder, int threads) {
  Result<TriangleMesh> mesh = wanted.specimen.empty()
                                  ? Result<TriangleMesh>(canonical_skull(0.6, threads))
                                  : read_ply(wanted.specimen);
  if (!mesh) return forward(mesh);
  Random random(mix(wanted.seed, 1));
  Rigid3 hand = rotation_about_z(random.normal(0.0, 4.0));
  hand.translation = {random.normal(0.0, 3.0), random.normal(0.0, 3.0), 0.0};
  const Rigid3 table_from_specimen = hand * rest_on_table(*mesh, Eigen::Quaterniond::Identity());

  SceneOptions options;
  options.bone.seed = wanted.seed;
  options.table_from_board = rotation_about_z(random.normal(0.0, 0.5));
  options.table_from_board.translation = {random.normal(0.0, 1.5), random.normal(0.0, 1.5), 0.0};
  const auto scene = SimulatedScene::build(*mesh, table_from_specimen, options, threads);
  if (!scene) return forward(scene);

  if (const auto made = make_writable_folder(folder / "images"); !made) return made;
  if (const auto made = make_writable_folder(folder / "masks"); !made) return made;
  Session session;
  session.created = "2026-01-31T12:00:00Z";
  session.station = "bench";
  session.case_number = "bench";
  session.board = options.board;
  const int per_ring = wanted.views / 2;
  for (const Ring& ring : kRings) {
    CameraOptics optics;
    optics.lens = ring_lens(wanted);
    optics.camera_from_station =
        camera_on_ring({0.0, 0.0, 100.0}, kDistance_mm, ring.elevation_deg, ring.azimuth_deg);
    optics.focus_distance_mm = kDistance_mm;
    const auto prepared = PreparedOptics::prepare(optics, threads);
    if (!prepared) return forward(prepared);
    session.cameras.push_back({ring.camera, wanted.width, wanted.height, LensModel::opencv,
                               optics.lens.params(LensModel::opencv), true});
    for (int i = 0; i < per_ring; ++i) {
      // The table is never quite where it was told to be.
      const double commanded_deg = 360.0 * i / per_ring;
      const double angle_deg = commanded_deg + random.normal(0.0, 0.03);
      RenderOptions how;
      how.seed = mix(wanted.seed, session.views.size());
      how.threads = threads;
      const ImageF light = render_radiance(*(*scene)->placed(), *prepared, {&angle_deg, 1}, how);
      const Image8 photograph =
          develop(light, SensorOptions{}, ExposureSettings{}, mix(how.seed, 1), threads);
      const ViewTruth truth = render_truth(*(*scene)->placed(), *prepared, angle_deg, threads);
      SessionView view;
      view.image = fmt::format("images/{}_{:03}.png", ring.camera, i);
      view.camera = ring.camera;
      view.table_angle_deg = commanded_deg;
      view.camera_from_table = optics.camera_from_station * rotation_about_z(angle_deg);
      view.mask = fmt::format("masks/{}_{:03}.png", ring.camera, i);
      for (const auto& [name, image] :
           {std::pair(view.image, photograph), std::pair(*view.mask, specimen_mask(truth))}) {
        const auto written = write_file_durably(folder / name, encode_png(image));
        if (!written) return written;
      }
      session.views.push_back(std::move(view));
    }
  }
  const auto truth = write_ply(placed(*std::move(mesh), table_from_specimen), folder / "truth.ply");
  if (!truth) return truth;
  return write_session(session, folder);  // last: a folder with a session is complete
}

}  // namespace

Result<fs::path> cached_scene(const BenchScene& scene, const fs::path& cache, int threads) {
  const std::string key = fmt::format("2:{}:{}:{}:{}:{}", scene.specimen, scene.width, scene.height,
                                      scene.views, scene.seed);
  const fs::path folder = cache / fmt::format("scene-{}x{}-{}-{}", scene.width, scene.height,
                                              scene.views, sha256_hex(key).substr(0, 8));
  if (fs::exists(folder / "session.json")) return folder;
  if (const auto rendered = render(scene, folder, threads); !rendered) return forward(rendered);
  return folder;
}

}  // namespace skullstation
