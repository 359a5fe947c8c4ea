#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/database/database.h"
#include "daemon/service/station_service.h"

namespace skullstation {

/// An examiner's signature below what a job made. A result that is made anew is another job and
/// needs another one.
struct Approval {
  std::int64_t job = 0;
  std::string by;
  std::string time;  ///< UTC, ISO 8601
  std::string note;
};

/// Who approved what, in a SQLite file. Nothing is ever taken back: it is in the audit log, too.
/// Safe from any thread.
class Approvals {
 public:
  static Result<std::unique_ptr<Approvals>> open(const std::filesystem::path& file,
                                                 const Clock& clock);

  /// Error (usage): it has been approved.
  Result<void> approve(std::int64_t job, const std::string& by, const std::string& note);
  Result<std::optional<Approval>> of(std::int64_t job);
  /// The oldest first.
  Result<std::vector<Approval>> all();

 private:
  Approvals(Database database, const Clock& clock)
      : database_(std::move(database)), clock_(clock) {}

  std::mutex mutex_;
  Database database_;
  const Clock& clock_;
};

/// Has sealed what was approved and is not: a crash may have come between the two.
Result<void> seal_approved(Approvals& approvals, StationService& service);

}  // namespace skullstation
