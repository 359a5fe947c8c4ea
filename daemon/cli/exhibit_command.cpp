#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/commands.h"
#include "daemon/exhibit/exhibit.h"
#include "daemon/station/station_config.h"

namespace skullstation {

Result<CommandReport> run(const ExhibitCommand& command, const CommonOptions&,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const MuseumConfig& museum = config->museum;
  const auto files = write_exhibit(
      command.package, {museum.holder, museum.rights, museum.rights_url, museum.base_url},
      SKULLSTATION_VERSION, command.out, progress);
  if (!files) return forward(files);
  CommandReport report;
  report.text = command.out.string() + "\n";
  for (const std::string& file : *files) report.text += fmt::format("  {}\n", file);
  report.json =
      nlohmann::ordered_json{{"exhibit", command.out.string()}, {"files", *files}}.dump(2);
  return report;
}

}  // namespace skullstation
