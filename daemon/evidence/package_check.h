#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/evidence/audit_entry.h"
#include "daemon/evidence/block_list.h"
#include "daemon/evidence/cms_signature.h"
#include "daemon/evidence/time_stamp.h"
#include "daemon/evidence/trust.h"

namespace skullstation {

enum class PackageFault { changed, missing, extra, renamed, malformed, signature, trust };

/// "changed", "missing", …
const char* to_string(PackageFault fault);

/// One thing that is not as it was sealed.
struct PackageFinding {
  PackageFault fault = PackageFault::changed;
  std::string file;               ///< in the bag
  std::vector<ByteRange> ranges;  ///< where it differs, if that can be told
  std::string what;               ///< for a person
};

struct PackageCheck {
  std::vector<PackageFinding> findings;  ///< empty: the package is as it was sealed
  std::string case_number;
  std::string station;
  std::uint64_t files = 0;  ///< listed in the manifest
  std::uint64_t bytes = 0;  ///< read of them
  bool ed25519_valid = false;
  std::string ed25519_fingerprint;
  std::optional<CmsSigner> cms_signer;  ///< absent: not valid
  /// Is one of the signatures a trusted one? Absent: no trust was given, so anybody may have
  /// signed.
  std::optional<bool> trusted;
  std::optional<AuditEntry> audit_entry;  ///< absent: none in the package, or not valid
  std::optional<TimeStamp> time_stamp;    ///< likewise
  /// Is the stamp's authority a trusted one? Absent: no stamp, or no trust was given. An authority
  /// that is not among the trusted is no finding: the station's own keys are what must be.
  std::optional<bool> time_stamp_trusted;
};

/// Checks a package by what lies in it and by `trust` alone: no network, no station. Fails only if
/// `folder` is no bag or can't be read; whatever is wrong with it else is a finding. Nothing in it
/// is followed out of it. Fails with `cancelled` on request.
Result<PackageCheck> check_package(const std::filesystem::path& folder,
                                   const std::optional<Trust>& trust,
                                   const Progress& progress = {});

}  // namespace skullstation
