#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "capture/calibration/calibration_file.h"
#include "capture/scan/contact_sheet.h"
#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/cli/commands.h"
#include "daemon/station/calibration_workflow.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station.h"
#include "reconstruction/distance/comparison.h"
#include "reconstruction/io/ply.h"

namespace skullstation {

namespace {

/// Lenses first: without them the scale is a tenth of a percent off. A demo that is run again finds
/// them measured.
Result<void> calibrate_lenses(const StationConfig& config, const CommonOptions& common,
                              const Progress& progress) {
  const auto count = static_cast<double>(config.cameras.size());
  for (std::size_t i = 0; i < config.cameras.size(); ++i) {
    const std::string& id = config.cameras[i].id;
    const auto file = camera_calibration_file(config, id);
    if (std::filesystem::exists(file)) continue;
    const double done = static_cast<double>(i) / count;
    const auto pictures = photograph_board(config, id, {}, common.seed, common.threads,
                                           progress.part(done, done + 1.0 / count));
    if (!pictures) return forward(pictures);
    const auto report = calibrate_from(*pictures, config.board, id);
    if (!report) return forward(report);
    if (const auto ready = make_writable_folder(file.parent_path()); !ready) return ready;
    if (const auto written = write_camera_calibration(report->calibration, file); !written) {
      return written;
    }
  }
  return {};
}

Result<DistanceStatistics> distance_from_truth(const std::filesystem::path& surface,
                                               const TriangleMesh& specimen, int threads) {
  const auto mesh = read_ply(surface);
  if (!mesh) return forward(mesh);
  ComparisonOptions options;
  options.align = Alignment::rigid;  // the specimen's own frame is not the table's
  options.threads = threads;
  const auto comparison = compare_surfaces(*mesh, specimen, options);
  if (!comparison) return forward(comparison);
  return comparison->a_to_b;
}

}  // namespace

Result<CommandReport> run(const DemoCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  StationConfig config;
  config.calibration_folder = (command.out / "calibration").string();
  if (const auto known = calibrate_lenses(config, common, progress.part(0.0, 0.1)); !known) {
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
  const auto surface = run(reconstruct, common, progress.part(0.55, 0.97));
  if (!surface) return forward(surface);
  const auto distance =
      distance_from_truth(reconstruct.out / "skull.ply", station->room->specimen(), common.threads);
  if (!distance) return forward(distance);

  const nlohmann::ordered_json json = {
      {"session", session_folder.string()},
      {"views", session->views.size()},
      {"rejected", scan->rejected.size()},
      {"contact_sheet", sheet_file.string()},
      {"reconstruction", nlohmann::ordered_json::parse(surface->json)},
      {"distance_from_truth_mm",
       {{"mean", distance->mean_mm}, {"median", distance->median_mm}, {"p95", distance->p95_mm}}}};
  return CommandReport{
      fmt::format("The simulated station photographed a synthetic skull: {} views in {} passes, "
                  "{} below the gates.\n  session        {}\n  all views      {}\n{}\n"
                  "Distance of that surface from the specimen's own: {:.2f} mm mean, {:.2f} mm "
                  "median, {:.2f} mm 95th percentile",
                  session->views.size(), config.scan.passes, scan->rejected.size(),
                  session_folder.string(), sheet_file.string(), surface->text, distance->mean_mm,
                  distance->median_mm, distance->p95_mm),
      json.dump(2)};
}

}  // namespace skullstation
