#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/session/session.h"
#include "daemon/cli/commands.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station.h"

namespace skullstation {

namespace {

CommandReport report_of(const ScanReport& scan, const std::filesystem::path& folder) {
  const nlohmann::ordered_json json = {{"session", folder.string()}, {"planned", scan.planned},
                                       {"taken", scan.taken},        {"kept", scan.kept},
                                       {"retries", scan.retries},    {"rejected", scan.rejected},
                                       {"replaced", scan.replaced}};
  std::string text = fmt::format("{} of {} views recorded in {}", scan.taken + scan.kept,
                                 scan.planned, folder.string());
  if (scan.kept > 0) text += fmt::format(" ({} of them by an earlier run)", scan.kept);
  if (scan.retries > 0) text += fmt::format("\n{} pictures were taken again", scan.retries);
  for (const std::string& view : scan.replaced) {
    text += fmt::format("\ndamaged or missing, taken again: {}", view);
  }
  for (const std::string& view : scan.rejected) text += fmt::format("\nnot good enough: {}", view);
  return {text, json.dump(2)};
}

}  // namespace

Result<CommandReport> run(const ScanCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  progress.report(0.0, "opening the station");
  auto station = open_station(*config, RoomSetting::specimen_on_table, common.seed, common.threads);
  if (!station) return forward(station);
  OperatorPrompts prompts;
  prompts.tell = [](std::string_view words) { fmt::print(stderr, "\n{}\n", words); };
  const auto scan =
      scan_specimen(*config, *station, command.case_number, command.out, prompts, progress);
  if (!scan) return forward(scan);
  return report_of(*scan, command.out);
}

Result<CommandReport> run(const SessionCheckCommand& command, const CommonOptions&,
                          const Progress&) {
  const auto session = read_session(command.session);
  if (!session) return forward(session);
  if (const auto intact = verify_images(*session, command.session); !intact) return forward(intact);
  std::size_t poses = 0;
  std::size_t hashes = 0;
  for (const SessionView& view : session->views) {
    poses += view.camera_from_table.has_value() ? 1 : 0;
    hashes += view.sha256.has_value() ? 1 : 0;
  }
  const nlohmann::ordered_json json = {
      {"session", command.session.string()}, {"station", session->station},
      {"case", session->case_number},        {"cameras", session->cameras.size()},
      {"views", session->views.size()},      {"with_pose", poses},
      {"verified_by_hash", hashes},          {"complete", session->complete.value_or(true)}};
  return CommandReport{
      fmt::format("{} views of {} cameras, {} with a given pose, {} verified by their hash{}",
                  session->views.size(), session->cameras.size(), poses, hashes,
                  session->complete.value_or(true) ? "" : "; the scan is not finished"),
      json.dump(2)};
}

}  // namespace skullstation
