#include "reconstruction/photogrammetry/quality_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <nlohmann/json.hpp>

namespace skullstation {

using Json = nlohmann::ordered_json;

namespace {

double percentile(std::vector<float> values, double fraction) {
  if (values.empty()) return 0.0;
  const auto nth = values.begin() +
                   static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

Json histogram_of(const std::vector<std::uint8_t>& views) {
  std::vector<int> counts(9);
  for (const std::uint8_t seen : views) ++counts[std::min<std::size_t>(seen, 8)];
  Json json = Json::object();
  for (std::size_t i = 0; i < counts.size(); ++i) {
    json[i == 8 ? "8 or more" : std::to_string(i)] = counts[i];
  }
  return json;
}

/// Four decimals are a tenth of a micrometre: more is noise in a file made for reading.
double rounded(double value) { return std::round(value * 1e4) / 1e4; }

}  // namespace

QualityFigures quality_figures(const SessionReconstruction& reconstruction) {
  QualityFigures figures;
  for (const ViewPose& view : reconstruction.poses.views) {
    ++figures.views;
    figures.views_used += view.used() ? 1 : 0;
  }
  const Coverage& coverage = reconstruction.surface.coverage;
  std::vector<float> sizes;
  std::vector<float> errors;
  std::size_t by_three = 0;
  for (std::size_t i = 0; i < coverage.views.size(); ++i) {
    by_three += coverage.views[i] >= 3 ? 1 : 0;
    if (coverage.views[i] < 2) continue;
    sizes.push_back(coverage.ground_sample_mm[i]);
    errors.push_back(coverage.accuracy_mm[i]);
  }
  figures.ground_sample_mm = percentile(std::move(sizes), 0.5);
  figures.accuracy_mm = percentile(errors, 0.5);
  figures.accuracy_p95_mm = percentile(std::move(errors), 0.95);
  const FilledOpenings& filled = reconstruction.surface.filled;
  const auto measured =
      static_cast<double>(coverage.views.size() - std::ranges::count(filled.vertices, true));
  figures.seen_by_three_percent =
      measured > 0.0 ? 100.0 * static_cast<double>(by_three) / measured : 0.0;
  figures.area_cm2 = 0.01 * surface_area(reconstruction.surface.mesh) - filled.area_cm2;
  figures.filled_cm2 = filled.area_cm2;
  figures.open_edge_mm = coverage.open_edge_mm;
  return figures;
}

std::vector<std::string> quality_verdicts(const SessionReconstruction& reconstruction,
                                          const QualityFigures& figures) {
  const PoseResult& poses = reconstruction.poses;
  std::vector<std::string> verdicts = poses.notes;
  for (const ViewPose& view : poses.views) {
    if (!view.used())
      verdicts.push_back(fmt::format("{} is left out: {}", view.name, view.dropped));
  }
  for (const SessionView& view : reconstruction.cameras.views) {
    if (!view.quality || !view.quality->rejected) continue;
    verdicts.push_back(
        fmt::format("{} did not pass the scan's gates: {}", view.image, *view.quality->rejected));
  }
  constexpr double few_percent = 90.0;
  if (figures.seen_by_three_percent < few_percent) {
    verdicts.push_back(
        fmt::format("only {:.0f} % of the surface is seen by 3 views or more; take more views, or "
                    "a pass with the specimen turned over",
                    figures.seen_by_three_percent));
  }
  if (figures.filled_cm2 > 0.0) {
    verdicts.push_back(fmt::format(
        "{:.2f} cm2 were not measured: {} openings were closed as their rims bend, the vertices' "
        "property `filled` marks them",
        figures.filled_cm2, reconstruction.surface.filled.closed));
  }
  constexpr double coarse_mm = 0.5;
  if (figures.ground_sample_mm > coarse_mm) {
    verdicts.push_back(
        fmt::format("a pixel is {:.2f} mm on the specimen; bring the camera nearer "
                    "or take one with more pixels",
                    figures.ground_sample_mm));
  }
  constexpr double uncertain_mm = 0.5;
  if (figures.accuracy_p95_mm > uncertain_mm) {
    verdicts.push_back(
        fmt::format("a twentieth of the surface is known to {:.2f} mm or worse; take more views, "
                    "and look at focus and light",
                    figures.accuracy_p95_mm));
  }
  constexpr double loose_scale_percent = 0.2;
  if (poses.scale_error_percent > loose_scale_percent) {
    verdicts.push_back(
        fmt::format("the scale has a standard error of {:.2f} %; calibrate the "
                    "cameras",
                    poses.scale_error_percent));
  }
  for (std::size_t c = 0; c < poses.lenses.size(); ++c) {
    constexpr double loose = 0.002;
    const AdjustedLens& lens = poses.lenses[c];
    if (!(lens.focal_error_px > loose * lens.lens.fx)) continue;
    verdicts.push_back(fmt::format(
        "the focal length of {} is known to {:.1f} % only; calibrate the "
        "camera",
        reconstruction.cameras.cameras[c].id, 100.0 * lens.focal_error_px / lens.lens.fx));
  }
  constexpr double large_departure_mm = 0.3;
  for (const TableMotion& table : poses.table) {
    if (table.departure_mm < large_departure_mm) continue;
    verdicts.push_back(
        fmt::format("in pass {} the board moves {:.2f} mm from stop to stop beside turning; check "
                    "that it lies fixed and that the cameras stand firm",
                    table.pass, table.departure_mm));
  }
  return verdicts;
}

std::string quality_json(const SessionReconstruction& reconstruction) {
  const QualityFigures figures = quality_figures(reconstruction);
  const PoseResult& poses = reconstruction.poses;
  Json json;
  json["format"] = "skullstation-reconstruction-quality/1";
  json["views"] = figures.views;
  json["views_used"] = figures.views_used;
  json["reprojection_rms_px"] = rounded(poses.rms_px);
  json["corner_noise_px"] = rounded(poses.corner_noise_px);
  json["scale"] = {{"source", to_string(poses.scale)},
                   {"standard_error_percent", rounded(poses.scale_error_percent)}};
  json["ground_sample_mm"] = rounded(figures.ground_sample_mm);
  json["accuracy_mm"] = {{"median", rounded(figures.accuracy_mm)},
                         {"p95", rounded(figures.accuracy_p95_mm)}};
  json["surface"] = {{"vertices", reconstruction.surface.mesh.vertices.rows()},
                     {"triangles", reconstruction.surface.mesh.triangles.rows()},
                     {"area_cm2", rounded(figures.area_cm2)},
                     {"open_edge_mm", rounded(figures.open_edge_mm)},
                     {"filled_cm2", rounded(figures.filled_cm2)},
                     {"openings_filled", reconstruction.surface.filled.closed},
                     {"seen_by_three_percent", rounded(figures.seen_by_three_percent)},
                     {"vertices_by_views", histogram_of(reconstruction.surface.coverage.views)}};
  Json lenses = Json::array();
  for (std::size_t c = 0; c < poses.lenses.size(); ++c) {
    lenses.push_back({{"camera", reconstruction.cameras.cameras[c].id},
                      {"focal_px", rounded(poses.lenses[c].lens.fx)},
                      {"focal_standard_error_px", rounded(poses.lenses[c].focal_error_px)}});
  }
  json["lenses"] = lenses;
  Json tables = Json::array();
  for (const TableMotion& table : poses.table) {
    tables.push_back({{"pass", table.pass},
                      {"reversed", table.reversed},
                      {"angle_rms_deg", rounded(table.angle_rms_deg)},
                      {"departure_mm", rounded(table.departure_mm)}});
  }
  json["table"] = tables;
  Json joins = Json::array();
  for (const JoinedPass& joined : reconstruction.joined) {
    joins.push_back({{"pass", joined.pass},
                     {"overlap", rounded(joined.join.overlap)},
                     {"rms_mm", rounded(joined.join.rms_mm)},
                     {"runner_up", rounded(joined.join.runner_up)}});
  }
  json["joined_passes"] = joins;
  Json views = Json::array();
  for (const ViewPose& view : poses.views) {
    Json entry = {{"image", view.name}, {"corners", view.corners}};
    if (view.points > 0) entry["points"] = view.points;
    if (view.used()) {
      entry["rms_px"] = rounded(view.rms_px);
      entry["position_error_mm"] = rounded(view.position_error_mm);
      entry["rotation_error_deg"] = rounded(view.rotation_error_deg);
    } else {
      entry["dropped"] = view.dropped;
    }
    if (!view.remark.empty()) entry["remark"] = view.remark;
    views.push_back(std::move(entry));
  }
  json["per_view"] = views;
  json["verdicts"] = quality_verdicts(reconstruction, figures);
  return json.dump(2) + "\n";
}

TriangleMesh colored_by_coverage(TriangleMesh mesh, const std::vector<std::uint8_t>& views) {
  mesh.colors.resize(mesh.vertices.rows(), 3);
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const int seen = views[static_cast<std::size_t>(i)];
    if (seen < 2) {
      mesh.colors.row(i) << 200, 40, 40;
    } else if (seen == 2) {
      mesh.colors.row(i) << 230, 190, 50;
    } else {
      const int cool = 25 * std::min(seen - 3, 5);
      mesh.colors.row(i) << 40, static_cast<std::uint8_t>(190 - cool),
          static_cast<std::uint8_t>(80 + cool);
    }
  }
  return mesh;
}

TriangleMesh colored_by_accuracy(TriangleMesh mesh, const std::vector<float>& accuracy_mm) {
  constexpr float step_mm = 0.1F;
  const std::array<Eigen::Array3f, 4> scale = {
      Eigen::Array3f{40, 80, 200}, {40, 170, 80}, {235, 200, 50}, {200, 40, 40}};
  mesh.colors.resize(mesh.vertices.rows(), 3);
  for (Eigen::Index i = 0; i < mesh.vertices.rows(); ++i) {
    const float error_mm = accuracy_mm[static_cast<std::size_t>(i)];
    if (!(error_mm > 0.0F)) {
      mesh.colors.row(i) << 150, 150, 150;
      continue;
    }
    const float at = std::min(error_mm / step_mm, 2.999F);
    const auto lower = static_cast<std::size_t>(at);
    const float share = at - static_cast<float>(lower);
    const Eigen::Array3f color = (1.0F - share) * scale[lower] + share * scale[lower + 1];
    mesh.colors.row(i) = color.cast<std::uint8_t>().transpose();
  }
  return mesh;
}

}  // namespace skullstation
