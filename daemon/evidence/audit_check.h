#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <istream>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/evidence/audit_entry.h"
#include "daemon/evidence/trust.h"

namespace skullstation {

/// Something that is not as it was written: which line, which bytes of the file, what.
struct AuditFinding {
  std::uint64_t line = 0;  ///< from 1; 0: the log as a whole
  std::uint64_t begin = 0, end = 0;
  std::string what;
};

struct AuditCheck {
  std::uint64_t entries = 0;
  std::string station;
  std::string last_time;
  std::string head_sha256;             ///< sum of the last entry's line
  std::string key_fingerprint;         ///< of the key that the log names in its first entry
  std::optional<bool> key_trusted;     ///< absent: no trust was given
  std::vector<AuditFinding> findings;  ///< empty: nothing was changed, removed or reordered
  std::vector<AuditFinding> notes;     ///< no tampering, but to be known: torn lines, clock jumps
};

/// An entry that was carried away in a package: the log must still hold it.
struct AuditHead {
  std::string origin;  ///< where it comes from, for messages
  std::string line;
};

/// Reads the log from its beginning: sums, numbers, signatures, torn bytes, heads. Without `trust`
/// the signatures are checked with the key in the log's first entry.
AuditCheck check_audit_log(std::istream& log, const std::optional<Trust>& trust,
                           const std::vector<AuditHead>& heads);

/// The same for a file. Fails if it can't be read.
Result<AuditCheck> check_audit_file(const std::filesystem::path& file,
                                    const std::optional<Trust>& trust,
                                    const std::vector<AuditHead>& heads);

}  // namespace skullstation
