#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace skullstation {

/// What a step may use up. It is ended where it wants more.
struct StepLimits {
  std::uint64_t memory_bytes = std::uint64_t{6} << 30;  ///< address space
  std::uint64_t file_bytes = std::uint64_t{8} << 30;    ///< of each file that it writes
  std::chrono::seconds cpu_time = std::chrono::hours{8};
  std::chrono::seconds time = std::chrono::hours{4};
  bool network = false;  ///< may it speak to others?
};

/// One kind of step in the chain of a case.
struct StepKind {
  std::string name;                   ///< of `skullstation step NAME`
  std::vector<std::string> inputs;    ///< steps whose artifacts it reads; "scan" is the session
  std::vector<std::string> promises;  ///< files that its artifact must have
  std::string options = "{}";         ///< JSON; for cases that say nothing else
  std::string station = "{}";         ///< JSON; what the step must know of the station, now
  bool on_approval = false;  ///< not appointed with the scan, but when a person approves the result
  std::uint64_t space_bytes = std::uint64_t{2} << 30;  ///< free space that it may need at its peak
  StepLimits limits;
};

/// In the order in which they are made; each reads only earlier ones.
using StepChain = std::vector<StepKind>;

/// The pictures: made by the scanner, not by a child process.
inline constexpr std::string_view scan_step = "scan";

/// Its artifact is what an examiner approves.
inline constexpr std::string_view result_step = "approximate";

/// Its artifact is a sealed package.
inline constexpr std::string_view seal_step = "seal";

/// With which keys, and in which audit log, packages are sealed.
struct SealSettings {
  bool on_approval = true;  ///< else as soon as the result is there
  std::string keys_folder;
  std::string audit_log;
  std::string time_stamp_url;  ///< empty: no stamp, and no network for the step
};

/// What the station does with a scan:
/// reconstruct  poses, depth, surface
/// approximate  skull fit, tissue, head, variants, report
/// seal         all of these as a package
StepChain station_chain(const std::string& quality, const StepLimits& limits,
                        const SealSettings& seal);

}  // namespace skullstation
