#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "core/result.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

/// What a crash left of an entry: the bytes between two entries.
struct TornBytes {
  std::uint64_t bytes = 0;
  std::string sha256;

  bool operator==(const TornBytes&) const = default;
};

/// One line of the audit log.
struct AuditEntry {
  std::uint64_t number = 1;  ///< counts from 1: order is by number, never by time
  std::string time;          ///< UTC, ISO 8601, by the station's clock
  std::string station;
  std::string who;
  std::string what;     ///< "package", "log begun", …
  std::string subject;  ///< case number; may be empty
  std::string details;  ///< JSON object
  std::optional<TornBytes> torn;
  std::string previous;  ///< SHA-256 of the line before (without its line feed); 64 zeros at first

  bool operator==(const AuditEntry&) const = default;
};

/// The most bytes that an entry's line may have.
constexpr std::size_t max_audit_line = std::size_t{64} * 1024;

/// The entry as a line of JSON without a line feed, its last member the Ed25519 signature of the
/// line before `,"signature":`. Fails for text that is no UTF-8, and for a line that is too long.
Result<std::string> format_audit_entry(const AuditEntry& entry, const StationKeys& keys);

/// Reads a line. The signature is not checked: audit_signature_valid() does that.
Result<AuditEntry> parse_audit_entry(std::string_view line, std::string_view name);

/// Did the key sign this line?
bool audit_signature_valid(std::string_view line, std::string_view public_pem);

/// The public key that the log's first entry names; nothing for any other entry.
std::optional<std::string> public_key_of(const AuditEntry& first);

}  // namespace skullstation
