#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/evidence/audit_entry.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

// The audit log of a station: a text file to which lines are added and never anything else done. A
// line is an entry (audit_entry.h); each carries the sum of the line before and the station's
// signature, so each is a signed head of the log up to there. docs/evidence.md says what that finds
// and what it can't.
//
// A crash can leave a piece of a line. It stays: the next append ends it with torn_mark and puts
// its size and sum into its own entry.

inline constexpr std::string_view torn_mark = " <torn>";

struct AuditLogPlace {
  std::filesystem::path file;  ///< made, with its first entry, by the first append
  std::string station;         ///< whose log it is
};

/// What happened: the log adds number, time, sum and signature.
struct AuditEvent {
  std::string who;
  std::string what;
  std::string subject;         ///< case number; may be empty
  std::string details = "{}";  ///< JSON object
};

/// Adds an entry; when this returns, a power cut can't take it away. Returns the entry's line, the
/// log's new head. Safe from several processes at once. Fails, and adds nothing, if the log's last
/// entry is damaged or was signed with another key.
Result<std::string> append_audit_entry(const AuditLogPlace& log, const AuditEvent& event,
                                       const StationKeys& keys, const Clock& clock);

}  // namespace skullstation
