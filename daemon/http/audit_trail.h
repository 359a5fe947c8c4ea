#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/evidence/audit_log.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

/// Where what people do at the console is written down, and with which keys.
struct AuditTrail {
  AuditLogPlace place;
  StationKeys keys;
  const Clock& clock;

  /// Returns when it is on the disk.
  Result<void> note(const std::string& who, const std::string& what, const std::string& subject,
                    const nlohmann::ordered_json& details) const;
};

/// The station's keys in this folder, made now if there are none.
Result<StationKeys> keys_in(const std::filesystem::path& folder, const std::string& station,
                            const Clock& clock);

}  // namespace skullstation
