#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "capture/scan/contact_sheet.h"
#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/cli/commands.h"
#include "daemon/station/scan_workflow.h"
#include "daemon/station/station.h"

namespace skullstation {

Result<CommandReport> run(const DemoCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const StationConfig config;
  progress.report(0.0, "making the specimen and opening the station");
  auto station = open_station(config, RoomSetting::specimen_on_table, common.seed, common.threads);
  if (!station) return forward(station);

  const auto session_folder = command.out / "session";
  const auto scan =
      scan_specimen(config, *station, "DEMO", session_folder, {}, progress.part(0.02, 0.97));
  if (!scan) return forward(scan);

  progress.report(0.97, "contact sheet");
  const auto session = read_session(session_folder);
  if (!session) return forward(session);
  const auto sheet =
      contact_sheet(*session, session_folder, config.scan.views_per_ring / 2, 200, common.threads);
  if (!sheet) return forward(sheet);
  const auto sheet_file = command.out / "contact_sheet.jpg";
  if (const auto written = write_file_durably(sheet_file, encode_jpeg(*sheet, 90)); !written) {
    return forward(written);
  }

  const nlohmann::ordered_json json = {{"session", session_folder.string()},
                                       {"views", session->views.size()},
                                       {"rejected", scan->rejected.size()},
                                       {"contact_sheet", sheet_file.string()}};
  return CommandReport{
      fmt::format("The simulated station photographed a synthetic skull: {} views in {} passes, "
                  "{} below the gates.\n  session        {}\n  all views      {}",
                  session->views.size(), config.scan.passes, scan->rejected.size(),
                  session_folder.string(), sheet_file.string()),
      json.dump(2)};
}

}  // namespace skullstation
