#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "core/clock.h"
#include "core/progress.h"
#include "core/result.h"
#include "daemon/evidence/audit_log.h"
#include "daemon/evidence/package_source.h"
#include "daemon/evidence/station_keys.h"
#include "daemon/evidence/time_stamp.h"

namespace skullstation {

// A package is a BagIt 1.0 bag (RFC 8493); docs/evidence.md shows it whole. Its tag files:
inline constexpr const char* bagit_file = "bagit.txt";
inline constexpr const char* bag_info_file = "bag-info.txt";
inline constexpr const char* manifest_file = "manifest-sha256.txt";
inline constexpr const char* tag_manifest_file = "tagmanifest-sha256.txt";
inline constexpr const char* blocks_file = "blocks-sha256.txt";
inline constexpr const char* metadata_file = "metadata.json";
inline constexpr const char* provenance_file = "provenance.json";
inline constexpr const char* public_key_file = "signature/ed25519.pub.pem";
inline constexpr const char* certificate_file = "signature/certificate.pem";
// Not in the tag manifest, since they are made of it:
inline constexpr const char* ed25519_file = "signature/ed25519.sig";
inline constexpr const char* cms_file = "signature/cms.p7s";
inline constexpr const char* time_stamp_file = "signature/time_stamp.tsr";
inline constexpr const char* audit_entry_file = "signature/audit_entry.json";
inline constexpr const char* signature_sums_file = "signature/sha256.txt";

inline constexpr const char* bagit_text =
    "BagIt-Version: 1.0\nTag-File-Character-Encoding: UTF-8\n";

struct PackageSummary {
  std::string case_number;
  std::uint64_t files = 0;
  std::uint64_t bytes = 0;
  std::string tag_manifest_sha256;  ///< names the package: the signatures and the audit log have it
};

/// Who seals, and what witnesses it.
struct Seal {
  const StationKeys& keys;
  std::optional<AuditLogPlace> audit_log;  ///< absent: no entry is made
  std::string who;
  TimeStamper time_stamper;  ///< stamps signature/cms.p7s; empty: no stamp
};

/// Seals a case: copies its files into a bag (each is read once), writes manifests, provenance,
/// signatures and, if it is asked for, an authority's time stamp and the entry in the audit log.
/// The bag appears whole or not at all, and never before its audit entry. The same case gives the
/// same bytes but for signature/cms.p7s, signature/time_stamp.tsr, signature/audit_entry.json and
/// signature/sha256.txt, which carry the time. Memory does not grow with the files' size.
/// Fails with `usage` where `out` is there already or lies in what is to be sealed, as the time
/// stamper does, `cancelled` on request.
Result<PackageSummary> write_package(const PackageSource& source, const Seal& seal,
                                     const Clock& clock, const std::filesystem::path& out,
                                     int threads, const Progress& progress = {});

}  // namespace skullstation
