#include <fmt/format.h>

#include <Eigen/LU>
#include <nlohmann/json.hpp>

#include "capture/scan/contact_sheet.h"
#include "core/file.h"
#include "core/random.h"
#include "core/session/image_file.h"
#include "daemon/cli/commands.h"
#include "daemon/model/model_source.h"
#include "daemon/station/calibration_workflow.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station.h"
#include "reconstruction/approximation/face_error.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/phantom/specimen.h"

namespace skullstation {

namespace {

/// Someone whom the default model has never seen.
Person demo_person(const CommonOptions& common) {
  constexpr double edge_mm = 1.0;
  return PersonMaker(edge_mm, common.threads)
      .make(draw_person(mix(common.seed, 0xde30)), common.threads);
}

Result<Comparison> compare_with_truth(const std::filesystem::path& surface,
                                      const TriangleMesh& specimen, int threads) {
  const auto mesh = read_ply(surface);
  if (!mesh) return forward(mesh);
  ComparisonOptions options;
  options.align = Alignment::rigid;  // the specimen's own frame is not the table's
  options.threads = threads;
  return compare_surfaces(*mesh, specimen, options);
}

/// Face of the case, which knows how it lies to its input, against the person's own skin.
Result<FaceError> face_error_of(const std::filesystem::path& case_folder,
                                const Similarity3& person_from_input, const Person& person,
                                int threads) {
  const auto head = read_ply(case_folder / "head.ply");
  if (!head) return forward(head);
  const auto text = read_file(case_folder / "case.json");
  if (!text) return forward(text);
  const auto source = load_model(std::nullopt);
  if (!source) return forward(source);
  const auto json = nlohmann::json::parse(*text);
  Eigen::Matrix4d anatomical_from_input;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) anatomical_from_input(r, c) = json["anatomical_from_input"][r][c];
  }
  const Eigen::Matrix4d person_from_anatomical =
      person_from_input.matrix() * anatomical_from_input.inverse();
  const Points3 vertices =
      (head->vertices.rowwise().homogeneous() * person_from_anatomical.transpose()).leftCols<3>();
  const Eigen::VectorXd unknown_band = Eigen::VectorXd::Zero(vertices.rows());
  return face_error(source->model.head_template, vertices, unknown_band, person.skin, threads);
}

}  // namespace

Result<CommandReport> run(const DemoCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  progress.report(0.0, "making a person");
  const Person person = demo_person(common);
  const auto specimen_file = command.out / "specimen.ply";
  if (const auto made = make_writable_folder(command.out); !made) return forward(made);
  if (const auto written = write_ply(specimen(person, {}, common.seed), specimen_file); !written) {
    return forward(written);
  }
  StationConfig config;
  config.simulation.specimen = specimen_file.string();
  config.calibration_folder = (command.out / "calibration").string();
  // Without the lenses the scale is a tenth of a percent off.
  if (const auto known =
          calibrate_lenses(config, common.seed, common.threads, progress.part(0.0, 0.1));
      !known) {
    return forward(known);
  }
  progress.report(0.1, "making the specimen and opening the station");
  auto station = open_station(config, RoomSetting::specimen_on_table, common.seed, common.threads);
  if (!station) return forward(station);

  const auto session_folder = command.out / "session";
  const auto scan =
      scan_specimen(config, *station, "DEMO", session_folder, {}, progress.part(0.1, 0.55));
  if (!scan) return forward(scan);

  progress.report(0.55, "contact sheet");
  const auto session = read_session(session_folder);
  if (!session) return forward(session);
  const auto sheet =
      contact_sheet(*session, session_folder, config.scan.views_per_ring / 2, 200, common.threads);
  if (!sheet) return forward(sheet);
  const auto sheet_file = command.out / "contact_sheet.jpg";
  if (const auto written = write_file_durably(sheet_file, encode_jpeg(*sheet, 90)); !written) {
    return forward(written);
  }

  ReconstructCommand reconstruct;
  reconstruct.session = session_folder;
  reconstruct.out = command.out / "reconstruction";
  std::error_code ignored;
  std::filesystem::remove_all(reconstruct.out, ignored);  // what an earlier demo left
  const auto surface = run(reconstruct, common, progress.part(0.55, 0.8));
  if (!surface) return forward(surface);
  const auto comparison =
      compare_with_truth(reconstruct.out / "skull.ply", station->room->specimen(), common.threads);
  if (!comparison) return forward(comparison);
  const DistanceStatistics& distance = comparison->a_to_b;

  ApproximateCommand approximate;
  approximate.skull = reconstruct.out / "skull.ply";
  approximate.out = command.out / "case";
  std::filesystem::remove_all(approximate.out, ignored);
  const auto face = run(approximate, common, progress.part(0.8, 0.98));
  if (!face) return forward(face);
  const auto error = face_error_of(approximate.out, comparison->b_from_a, person, common.threads);
  if (!error) return forward(error);

  const nlohmann::ordered_json json = {
      {"session", session_folder.string()},
      {"views", session->views.size()},
      {"rejected", scan->rejected.size()},
      {"contact_sheet", sheet_file.string()},
      {"reconstruction", nlohmann::ordered_json::parse(surface->json)},
      {"distance_from_truth_mm",
       {{"mean", distance.mean_mm}, {"median", distance.median_mm}, {"p95", distance.p95_mm}}},
      {"case", nlohmann::ordered_json::parse(face->json)},
      {"face_error_mm",
       {{"mean", error->mean_mm},
        {"p95", error->p95_mm},
        {"mean_over_bone", error->over_bone_mean_mm}}}};
  return CommandReport{
      fmt::format("The simulated station photographed the skull of a synthetic person: {} views in "
                  "{} passes, {} below the gates.\n  session        {}\n  all views      {}\n{}\n"
                  "Distance of that surface from the specimen's own: {:.2f} mm mean, {:.2f} mm "
                  "median, {:.2f} mm 95th percentile\n\n{}"
                  "Distance of the face from the person's own: {:.1f} mm mean, {:.1f} mm 95th "
                  "percentile\n",
                  session->views.size(), config.scan.passes, scan->rejected.size(),
                  session_folder.string(), sheet_file.string(), surface->text, distance.mean_mm,
                  distance.median_mm, distance.p95_mm, face->text, error->mean_mm, error->p95_mm),
      json.dump(2)};
}

}  // namespace skullstation
