#include "daemon/model/model_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr double variant_sd = 2.0;

/// The mean and +-2 standard deviations along the first two modes; `mesh_of` makes a mesh of the
/// template's vertices.
Result<CaptionedPictures> variants(const ShapeModel& shape,
                                   const std::function<TriangleMesh(const Points3&)>& mesh_of,
                                   const Eigen::Vector3d& color,
                                   const ReportPictureOptions& options) {
  CaptionedPictures pictures;
  const Index modes = std::min<Index>(2, shape.mode_count());
  for (Index mode = 0; mode < modes; ++mode) {
    for (const double steps : {-variant_sd, 0.0, variant_sd}) {
      Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(shape.mode_count());
      coefficients[mode] = steps;
      const TriangleMesh mesh = mesh_of(shape_at(shape, coefficients));
      PicturedMesh pictured;
      pictured.mesh = &mesh;
      pictured.color = color;
      const auto done =
          add_sides(pictures, std::span(&pictured, 1), {"left three-quarter"}, "", options);
      if (!done) return forward(done);
      pictures.back().first =
          steps == 0.0 ? "mean" : fmt::format("mode {}, {:+.0f} SD", mode + 1, steps);
    }
  }
  return pictures;
}

/// Values over the mean skull's outside in colour; grey where there are none.
Result<void> add_on_skull(CaptionedPictures& pictures, const FaceModel& model,
                          const Eigen::VectorXd& values, double low, double high,
                          const std::string& caption, const ReportPictureOptions& options) {
  TriangleMesh skull = surface_of(model.skull_template, unflattened(model.skull.mean));
  skull.colors = scalar_colors(values, low, high);
  PicturedMesh pictured;
  pictured.mesh = &skull;
  return add_sides(pictures, std::span(&pictured, 1), {"front", "left"}, caption, options);
}

Result<CaptionedPictures> tissue_pictures(const FaceModel& model,
                                          const ReportPictureOptions& options) {
  const TissueModel& tissue = model.tissue;
  const auto known = [&](const Eigen::VectorXd& values) {
    Eigen::VectorXd shown = values;
    for (Index v = 0; v < shown.size(); ++v) {
      if (!tissue.modelled[static_cast<std::size_t>(v)]) shown[v] = std::nan("");
    }
    return shown;
  };
  CaptionedPictures pictures;
  const int most = tissue.count.maxCoeff();
  for (const auto& done :
       {add_on_skull(pictures, model, known(tissue.mean_mm), 2.0, 25.0,
                     "mean depth, 2 (dark) to 25 mm (yellow)", options),
        add_on_skull(pictures, model, known(tissue.sd_mm), 0.0, 7.0,
                     "standard deviation, 0 to 7 mm", options),
        add_on_skull(pictures, model, tissue.count.cast<double>(), 0.0, most,
                     fmt::format("subjects measured, 0 to {}", most), options)}) {
    if (!done) return forward(done);
  }
  return pictures;
}

std::vector<ErrorBars::Row> depths_beside_t_table(const FaceModel& model) {
  std::vector<ErrorBars::Row> rows;
  for (const TissueThickness& entry : thickness_table()) {
    for (const SkinDirection& direction : model.skin_directions) {
      const std::string bone(entry.bone);
      if (direction.name != bone && direction.name != bone + " left") continue;
      rows.push_back({std::string(entry.pair),
                      {direction.depth_mm, direction.depth_sd_mm},
                      {entry.mean_mm, entry.sd_mm}});
    }
  }
  return rows;
}

}  // namespace

Result<Report> model_report(const ModelSource& source, const ReportPictureOptions& options,
                            const Progress& progress) {
  const FaceModel& model = source.model;
  Report report{"Statistical model of skull, soft tissue and head", {}};
  report.add(Warning{"who", source.card});

  progress.report(0.0, "skulls");
  const auto skulls = variants(
      model.skull, [&](const Points3& v) { return surface_of(model.skull_template, v); },
      PicturedMesh{}.color, options);
  if (!skulls) return forward(skulls);
  report.add(Heading{"Skulls along the first two modes"});
  report.add(Pictures{*skulls});
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "report", "stopped");

  progress.report(0.3, "heads");
  const auto heads = variants(
      model.head, [&](const Points3& v) { return surface_of(model.head_template, v); }, skin_color,
      options);
  if (!heads) return forward(heads);
  report.add(Heading{"Heads along the first two modes"});
  report.add(Pictures{*heads});
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "report", "stopped");

  progress.report(0.6, "soft tissue");
  const auto tissue = tissue_pictures(model, options);
  if (!tissue) return forward(tissue);
  report.add(Heading{"Soft tissue thickness over the mean skull"});
  report.add(Paragraph{
      "The distance from each place of the bone to the nearest skin. Grey: too few subjects, or "
      "the inside of the skull, where the nearest skin says nothing."});
  report.add(Pictures{*tissue});

  report.add(Heading{"At the landmarks"});
  const std::vector<ErrorBars::Row> depths = depths_beside_t_table(model);
  const auto near = std::ranges::count_if(depths, [](const ErrorBars::Row& row) {
    return std::abs(row.ours.mean - row.reference.mean) <= row.reference.sd;
  });
  report.add(Paragraph{fmt::format(
      "Mean and standard deviation from bone landmark to skin landmark: the model's subjects "
      "(filled) beside the T-Table of Hona and Stephan 2024 (open). {} of {} means lie within one "
      "standard deviation of the table's.",
      near, depths.size())});
  report.add(ErrorBars{depths, "mm", "model", "T-Table"});

  report.add(Heading{"Figures"});
  std::vector<std::pair<std::string, std::string>> rows = {
      {"file", source.name},
      {"SHA-256", source.sha256},
      {"subjects", std::to_string(model.joint.subjects)},
      {"skull",
       fmt::format("{} vertices, {} modes", model.skull.vertex_count(), model.skull.mode_count())},
      {"head",
       fmt::format("{} vertices, {} modes", model.head.vertex_count(), model.head.mode_count())},
      {"soft tissue", fmt::format("{} modes", model.tissue.mode_count())},
      {"joint model", fmt::format("{} variables", model.joint.names.size())}};
  for (std::size_t b = 1; b < model.joint.blocks.size(); ++b) {
    rows.emplace_back(fmt::format("{} follows from (penalty)", model.joint.blocks[b]),
                      told_by(model.joint, b));
  }
  for (const BandFactor& band : model.bands) {
    rows.emplace_back(fmt::format("{:.0f} % band, {}", 100.0 * band.level, band.region),
                      fmt::format("{:.2f} standard deviations", band.factor));
  }
  report.add(Table{rows});
  if (!source.remarks.empty()) {
    report.add(Heading{"Subjects of whom something has to be said"});
    report.add(Table{source.remarks});
  }
  return report;
}

}  // namespace skullstation
