#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/cli/commands.h"
#include "daemon/model/model_source.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/registration/head_registration.h"
#include "reconstruction/registration/skull_registration.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

std::string name_of(const std::optional<std::filesystem::path>& templates) {
  return templates ? templates->string() : "default model";
}

Json json_of(const FitDistances& distances) {
  return {{"points", distances.points},
          {"mean_mm", distances.mean_mm},
          {"rms_mm", distances.rms_mm},
          {"p95_mm", distances.p95_mm},
          {"max_mm", distances.max_mm}};
}

Json json_of(const FitStages& stages) {
  Json list = Json::array();
  for (const FitStage& stage : stages) {
    list.push_back({{"name", stage.name},
                    {"iterations", stage.iterations},
                    {"correspondences", stage.correspondences},
                    {"rms_mm", stage.rms_mm},
                    {"last_move_mm", stage.last_move_mm},
                    {"processor_s", stage.processor_seconds}});
  }
  return list;
}

Json json_of(const std::vector<TemplateLandmark>& landmarks, const Points3& vertices) {
  const Points3 positions = landmark_positions(landmarks, vertices);
  Json list = Json::array();
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    list.push_back({{"name", landmarks[i].name},
                    {"position", {positions(row, 0), positions(row, 1), positions(row, 2)}}});
  }
  return list;
}

std::string row_of(const char* name, const FitDistances& d) {
  return fmt::format("{:<26}{:>9}{:>9.3f}{:>9.3f}{:>9.3f}{:>9.3f}\n", name, d.points, d.mean_mm,
                     d.rms_mm, d.p95_mm, d.max_mm);
}

std::string heading() {
  return fmt::format("{:<26}{:>9}{:>9}{:>9}{:>9}{:>9}\n", "distance [mm]", "points", "mean", "RMS",
                     "P95", "max");
}

std::string text_of(const FitStages& stages) {
  std::string text =
      fmt::format("\n{:<26}{:>9}{:>9}{:>9}{:>11}\n", "stage", "rounds", "pairs", "RMS", "seconds");
  for (const FitStage& stage : stages) {
    text += fmt::format("{:<26}{:>9}{:>9}{:>9.3f}{:>11.2f}\n", stage.name, stage.iterations,
                        stage.correspondences, stage.rms_mm, stage.processor_seconds);
  }
  return text;
}

std::string text_of(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& warning : warnings) text += "warning: " + warning + "\n";
  return text;
}

/// The mesh first, then the report that speaks of it.
Result<void> write_fit(const TriangleMesh& mesh, const std::string& name, const Json& json,
                       const std::filesystem::path& folder) {
  if (auto made = make_writable_folder(folder); !made) return forward(made);
  if (auto written = write_mesh(mesh, folder / name); !written) return forward(written);
  return write_file_durably(folder / "fit.json", json.dump(2) + "\n");
}

}  // namespace

Result<CommandReport> run(const FitSkullCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto templates = load_templates(command.templates);
  if (!templates) return forward(templates);
  const auto input = read_mesh(command.mesh);
  if (!input) return forward(input);
  SkullRegistrationOptions options;
  options.regularizer = command.regularizer;
  options.unit_unknown = command.unit_unknown;
  options.seed = common.seed;
  options.threads = common.threads;
  const auto fit = register_skull(templates->skull, *input, options, progress);
  if (!fit) return forward(command.mesh.string(), fit);

  const SkullFitQuality& quality = fit->quality;
  const Json json = {{"format", "skullstation-fit/1"},
                     {"kind", "skull"},
                     {"input", command.mesh.string()},
                     {"templates", name_of(command.templates)},
                     {"input_from_template", matrix_rows(fit->input_from_template.matrix())},
                     {"facial", json_of(quality.facial)},
                     {"facial_bone", json_of(quality.facial_bone)},
                     {"outer", json_of(quality.outer)},
                     {"inverted_tetrahedra", quality.inverted_tetrahedra},
                     {"least_scaled_volume", quality.least_scaled_volume},
                     {"observed_share", quality.observed_share},
                     {"mandible_observed_share", quality.mandible_observed_share},
                     {"warnings", fit->warnings},
                     {"stages", json_of(fit->stages)},
                     {"landmarks", json_of(templates->skull.landmarks, fit->vertices)}};
  if (auto written = write_fit(surface_of(templates->skull, fit->vertices), "skull_fitted.ply",
                               json, command.out);
      !written) {
    return forward(written);
  }
  CommandReport report;
  report.json = json.dump(2);
  report.text = heading() + row_of("input's face to fit", quality.facial) +
                row_of("the same without teeth", quality.facial_bone) +
                row_of("input's outside to fit", quality.outer) +
                fmt::format(
                    "{} inverted tetrahedra, least volume {:.2f} of rest; {:.0f} % of the outside "
                    "seen, {:.0f} % of the mandible's\n",
                    quality.inverted_tetrahedra, quality.least_scaled_volume,
                    100.0 * quality.observed_share, 100.0 * quality.mandible_observed_share) +
                text_of(fit->warnings) + text_of(fit->stages);
  return report;
}

Result<CommandReport> run(const FitHeadCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto templates = load_templates(command.templates);
  if (!templates) return forward(templates);
  const auto input = read_mesh(command.mesh);
  if (!input) return forward(input);
  HeadRegistrationOptions options;
  options.unit_unknown = command.unit_unknown;
  options.seed = common.seed;
  options.threads = common.threads;
  const auto fit = register_head(templates->head, *input, options, progress);
  if (!fit) return forward(command.mesh.string(), fit);

  const HeadFitQuality& quality = fit->quality;
  const Json json = {{"format", "skullstation-fit/1"},
                     {"kind", "head"},
                     {"input", command.mesh.string()},
                     {"templates", name_of(command.templates)},
                     {"input_from_template", matrix_rows(fit->input_from_template.matrix())},
                     {"weighted_rms_mm", quality.weighted_rms_mm},
                     {"kept_share", quality.kept_share},
                     {"kept", json_of(quality.kept)},
                     {"facial", json_of(quality.facial)},
                     {"warnings", fit->warnings},
                     {"stages", json_of(fit->stages)},
                     {"landmarks", json_of(templates->head.landmarks, fit->vertices)}};
  if (auto written = write_fit(surface_of(templates->head, fit->vertices), "head_fitted.ply", json,
                               command.out);
      !written) {
    return forward(written);
  }
  CommandReport report;
  report.json = json.dump(2);
  report.text = heading() + row_of("input to fit, kept", quality.kept) +
                row_of("input's face to fit", quality.facial) +
                fmt::format("weighted RMS {:.3f} mm over the {:.1f} % kept within 2 mm\n",
                            quality.weighted_rms_mm, 100.0 * quality.kept_share) +
                text_of(fit->warnings) + text_of(fit->stages);
  return report;
}

}  // namespace skullstation
