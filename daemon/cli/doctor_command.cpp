#include <fmt/format.h>

#include <array>
#include <nlohmann/json.hpp>

#include "daemon/cli/commands.h"
#include "daemon/station/station.h"
#include "daemon/station/station_check.h"
#include "daemon/station/station_config.h"

namespace skullstation {

namespace {

CommandReport report_of(const std::vector<Finding>& findings) {
  constexpr std::array<const char*, 3> marks{"  ok  ", " WARN ", " FAIL "};
  std::string text;
  auto json = nlohmann::ordered_json::array();
  bool failed = false;
  for (const Finding& finding : findings) {
    const auto verdict = static_cast<std::size_t>(finding.verdict);
    failed = failed || finding.verdict == Verdict::failure;
    text += fmt::format("[{}] {:<14} {}\n", marks[verdict], finding.topic, finding.what);
    if (!finding.advice.empty()) text += fmt::format("{:<23} -> {}\n", "", finding.advice);
    json.push_back({{"verdict", to_string(finding.verdict)},
                    {"topic", finding.topic},
                    {"what", finding.what},
                    {"advice", finding.advice}});
  }
  return {text, nlohmann::ordered_json{{"findings", json}}.dump(2),
          failed ? exit_code(ErrorKind::hardware) : 0};
}

}  // namespace

Result<CommandReport> run(const DoctorCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  Findings findings;
  findings.ok("configuration",
              command.config.empty() ? "defaults: a simulated station" : command.config.string());
  check_machine(*config, ".", findings);

  progress.report(0.2, "opening the station");
  auto station = open_station(*config, RoomSetting::bare_table, common.seed, common.threads);
  if (!station) {
    findings.fail("station", station.error());
  } else {
    check_parts(*config, *station, findings);
  }
  return report_of(findings.list);
}

}  // namespace skullstation
