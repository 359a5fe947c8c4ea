#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "daemon/cli/commands.h"
#include "daemon/evidence/cms_signature.h"
#include "daemon/evidence/signature.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

Result<CommandReport> run(const KeysCreateCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const NewStationKeys wanted = {command.station, command.valid_days};
  if (const auto made = create_station_keys(command.folder, wanted, SystemClock()); !made) {
    return forward(made);
  }
  return run(KeysShowCommand{command.folder}, common, progress);
}

Result<CommandReport> run(const KeysShowCommand& command, const CommonOptions&, const Progress&) {
  const auto keys = read_station_keys(command.folder);
  if (!keys) return forward(keys);
  const std::string ed25519 = public_key_fingerprint(keys->ed25519_public_pem);
  const CmsSigner owner = certificate_owner(keys->certificate_pem).value_or(CmsSigner{});
  CommandReport report;
  report.text = fmt::format(
      "{}\n  Ed25519 key {}\n  certificate {} ({})\nGive {} and certificate.pem, or these "
      "fingerprints, to those who will verify,\nby another way than the packages. The .key files "
      "never leave the station.\n",
      command.folder.string(), ed25519, owner.fingerprint, owner.name, "ed25519.pub.pem");
  report.json = nlohmann::ordered_json{
      {"keys", command.folder.string()},
      {"ed25519_key_sha256", ed25519},
      {"certificate_sha256", owner.fingerprint},
      {"certificate_name",
       owner.name}}.dump(2);
  return report;
}

}  // namespace skullstation
