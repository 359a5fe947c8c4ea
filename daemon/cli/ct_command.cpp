#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/staged_folder.h"
#include "daemon/cli/commands.h"
#include "daemon/subject/subject_folder.h"
#include "daemon/subject/subject_json.h"
#include "reconstruction/volume/volume_file.h"

namespace skullstation {

namespace {

CommandReport report_of(const CtSurfaces& surfaces, const VolumeInfo& info,
                        const std::filesystem::path& folder) {
  const CtQuality& q = surfaces.quality;
  CommandReport report;
  report.text =
      fmt::format("{}\n  skull: {} vertices, {}\n  skin:  {} vertices, {}\n", folder.string(),
                  surfaces.skull.vertices.rows(), q.skull_closed_manifold ? "closed" : "NOT CLOSED",
                  surfaces.skin.vertices.rows(), q.skin_closed_manifold ? "closed" : "NOT CLOSED");
  for (const std::string& correction : info.warnings) report.text += "note: " + correction + "\n";
  for (const CtFinding& finding : q.findings) {
    report.text += fmt::format("warning: {}: {}\n", to_string(finding.warning), finding.text);
  }
  report.text += fmt::format("look at it: {}\n", (folder / "report.html").string());
  auto json = nlohmann::ordered_json::parse(quality_json(surfaces));
  json["subject"] = folder.string();
  json["corrections"] = info.warnings;
  report.json = json.dump(2);
  return report;
}

}  // namespace

Result<CommandReport> run(const CtImportCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  CtSurfaceOptions options = command.surfaces;
  options.threads = common.threads;
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto free = check_new_folder(command.out); !free) return forward(free);

  auto volume = read_volume(command.input, command.read, progress.part(0.0, 0.25));
  if (!volume) return forward(volume);
  if (command.sex) volume->info.sex = *command.sex == "male" ? "M" : "F";
  if (command.age_years) volume->info.age_years = command.age_years;
  if (command.body_mass_index) volume->info.body_mass_index = command.body_mass_index;
  const SubjectSource source{volume->info, volume->grid, volume_sha256(*volume), options,
                             SKULLSTATION_VERSION};
  const auto surfaces = extract_ct_surfaces(*std::move(volume), options, progress.part(0.25, 0.85));
  if (!surfaces) return forward(surfaces);
  if (const auto written = write_subject_folder(*surfaces, source, command.out, common.threads,
                                                progress.part(0.85, 1.0));
      !written) {
    return forward(written);
  }
  return report_of(*surfaces, source.info, command.out);
}

}  // namespace skullstation
