#include <cstddef>
#include <cstdint>
#include <sstream>
#include <string>

#include "daemon/evidence/audit_check.h"

/// A log that has no finding ends with a signed entry; every finding lies in the file.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace skullstation;
  const std::string text(reinterpret_cast<const char*>(data), size);
  std::istringstream in(text);
  const AuditCheck check =
      check_audit_log(in, std::nullopt, {{"head", text.substr(0, text.find('\n'))}});
  if (check.findings.empty() && (check.entries == 0 || text.back() != '\n')) __builtin_trap();
  for (const AuditFinding& finding : check.findings) {
    if (finding.begin > finding.end || finding.end > size) __builtin_trap();
  }
  return 0;
}
