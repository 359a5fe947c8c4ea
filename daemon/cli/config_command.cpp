#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/commands.h"
#include "daemon/station/config_toml.h"
#include "daemon/station/station_config.h"

namespace skullstation {

Result<CommandReport> run(const ConfigCheckCommand& command, const CommonOptions&,
                          const Progress&) {
  const LoadedConfig loaded = load_config(command.config);
  std::string text;
  auto problems = nlohmann::ordered_json::array();
  for (const Error& problem : loaded.problems) {
    text += problem.message() + "\n";
    problems.push_back(
        {{"where", problem.where}, {"what", problem.what}, {"advice", problem.advice}});
  }
  if (loaded.problems.empty()) text = command.config.string() + ": no mistakes found";
  const nlohmann::ordered_json json = {{"config", command.config.string()}, {"problems", problems}};
  return CommandReport{text, json.dump(2),
                       loaded.problems.empty() ? 0 : exit_code(ErrorKind::bad_input)};
}

Result<CommandReport> run(const ConfigShowCommand& command, const CommonOptions&, const Progress&) {
  LoadedConfig loaded = load_config(command.config);
  if (!loaded.problems.empty()) return tl::unexpected(loaded.problems.front());
  const ConfigWalk walk = [&](ConfigFields& fields) { visit_config(loaded.config, fields); };
  return CommandReport{show_toml(walk, loaded.origins), show_json(walk, loaded.origins)};
}

}  // namespace skullstation
