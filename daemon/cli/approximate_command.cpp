#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/staged_folder.h"
#include "daemon/case/case_folder.h"
#include "daemon/case/known_depths.h"
#include "daemon/cli/commands.h"
#include "daemon/model/model_source.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/mesh/vertex_clustering.h"

namespace skullstation {

Result<CommandReport> run(const ApproximateCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  if (const auto free = check_new_folder(command.out); !free) return forward(free);
  FaceOptions options;
  options.threads = common.threads;
  options.facts.age_years = command.age_years;
  options.facts.body_mass_index = command.body_mass_index;
  if (command.sex) options.facts.male = *command.sex == "male" ? 1.0 : 0.0;
  if (command.mean_tissue) options.tissue = TissueChoice::population;
  options.feature_rules = !command.no_feature_rules;
  if (const auto sound = options.validate(); !sound) return forward(sound);

  CaseSource source;
  auto input_sha256 = sha256_of_file(command.skull);
  if (!input_sha256) return forward(input_sha256);
  source.input = command.skull.filename().string();
  source.input_sha256 = *std::move(input_sha256);
  progress.report(0.0, "reading the skull");
  auto scan = read_mesh(command.skull);
  if (!scan) return forward(scan);
  // Searches in it take ten times the memory of the mesh itself, and a template whose edges are
  // 1.7 mm long gains nothing from finer ones.
  const Eigen::Index triangles_given = scan->triangles.rows();
  const TriangleMesh input = thinned(*std::move(scan), command.most_triangles);
  const auto model_source = load_model(command.model);
  if (!model_source) return forward(model_source);
  const FaceModel& model = model_source->model;
  source.model = model_source->name;
  source.model_sha256 = model_source->sha256;
  source.model_card = model_source->card;
  source.program_version = SKULLSTATION_VERSION;
  source.facts = options.facts;
  source.seed = common.seed;

  source.ancestry = command.ancestry;
  source.variant_steps = command.variants == 1 ? 1 : command.variants == 9 ? 3 : 5;
  source.tissue = command.mean_tissue
                      ? "the population's mean depths"
                      : "depths foretold from the skull and from what else is known";
  if (!command.tissue.empty()) {
    auto depths = read_known_depths(command.tissue, model.skull_template);
    if (!depths) return forward(depths);
    options.known_depths = *std::move(depths);
    const auto table = read_file(command.tissue);
    if (!table) return forward(table);
    source.tissue += fmt::format(", bent to the {} depths of {}", options.known_depths.size(),
                                 command.tissue.filename().string());
    source.tissue_sha256 = sha256_hex(*table);
  }

  SkullRegistrationOptions fit_options;
  fit_options.unit_unknown = command.unit_unknown;
  fit_options.seed = common.seed;
  fit_options.threads = common.threads;
  auto skull = fit_case_skull(model, input, fit_options, progress.part(0.05, 0.6));
  if (!skull) return forward(command.skull.string(), skull);
  if (input.triangles.rows() < triangles_given) {
    skull->warnings.push_back(fmt::format("The scan's {} triangles were thinned to {}.",
                                          triangles_given, input.triangles.rows()));
  }
  const auto face = estimate_face(model, *skull, options, progress.part(0.6, 0.75));
  if (!face) return forward(face);
  if (const auto written = write_case_folder(model, *skull, *face, source, command.out,
                                             {.threads = common.threads}, progress.part(0.75, 1.0));
      !written) {
    return forward(written);
  }

  CommandReport report;
  std::vector<std::string> warnings = skull->warnings;
  warnings.insert(warnings.end(), face->warnings.begin(), face->warnings.end());
  for (const std::string& warning : warnings) report.text += "warning: " + warning + "\n";
  report.text += fmt::format(
      "{}\n  skull to template: mean {:.2f} mm, P95 {:.2f} mm; {:.0f} % observed\n"
      "  face: +- {:.1f} mm (80 % band, mean over the head)\n  look at it: {}\n",
      command.out.string(), skull->quality.facial.mean_mm, skull->quality.facial.p95_mm,
      100.0 * skull->quality.observed_share, face->band_mm.mean(),
      (command.out / "report.html").string());
  report.json = nlohmann::ordered_json{
      {"case", command.out.string()},
      {"facial_mean_mm", skull->quality.facial.mean_mm},
      {"facial_p95_mm", skull->quality.facial.p95_mm},
      {"observed_share", skull->quality.observed_share},
      {"strangeness_sd", skull->strangeness},
      {"mean_band80_mm", face->band_mm.mean()},
      {"warnings",
       warnings}}.dump(2);
  return report;
}

}  // namespace skullstation
