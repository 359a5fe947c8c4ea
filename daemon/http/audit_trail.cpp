#include "daemon/http/audit_trail.h"

namespace skullstation {

Result<void> AuditTrail::note(const std::string& who, const std::string& what,
                              const std::string& subject,
                              const nlohmann::ordered_json& details) const {
  const auto appended = append_audit_entry(
      place,
      {who, what, subject,
       details.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace)},
      keys, clock);
  if (!appended) return forward(appended);
  return {};
}

Result<StationKeys> keys_in(const std::filesystem::path& folder, const std::string& station,
                            const Clock& clock) {
  std::error_code ignored;
  if (!std::filesystem::exists(folder, ignored)) {
    NewStationKeys wanted;
    wanted.station = station;
    if (auto made = create_station_keys(folder, wanted, clock); !made) return forward(made);
  }
  return read_station_keys(folder);
}

}  // namespace skullstation
