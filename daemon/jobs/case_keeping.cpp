// How long the store keeps a case's files, and whether they are still what they were: holds,
// deliveries, deletion, damage.

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <set>
#include <utility>

#include "daemon/jobs/case_store.h"

namespace skullstation {

Result<void> CaseStore::set_hold(std::int64_t case_id, const std::optional<std::string>& reason) {
  const std::lock_guard lock(mutex_);
  if (auto known = case_of(case_id); !known) return forward(known);
  Transaction transaction(database_);
  if (auto set = database_.statement("UPDATE cases SET hold = ? WHERE id = ?")
                     .bind_optional(reason)
                     .bind(case_id)
                     .done();
      !set) {
    return set;
  }
  if (auto noted = note(case_id, reason ? "held: " + *reason : "no longer held"); !noted) {
    return noted;
  }
  return transaction.commit();
}

Result<bool> CaseStore::set_verified(std::int64_t case_id, std::int64_t job_id) {
  const std::lock_guard lock(mutex_);
  if (auto known = case_of(case_id); !known) return forward(known);
  const auto delivered = job(job_id);
  if (!delivered) return forward(delivered);
  const auto all = jobs(case_id);
  if (!all) return forward(all);
  std::set<std::int64_t> present;
  for (const Job& current : current_jobs(*all)) present.insert(current.id);
  if (!present.contains(job_id) || !std::ranges::all_of(delivered->inputs, [&](const auto& input) {
        return present.contains(input.second);
      })) {
    return false;
  }
  Transaction transaction(database_);
  if (auto set = database_.statement("UPDATE cases SET verified = ? WHERE id = ?")
                     .bind(now())
                     .bind(case_id)
                     .done();
      !set) {
    return forward(set);
  }
  if (auto noted = note(case_id, "delivered and verified"); !noted) return forward(noted);
  if (auto committed = transaction.commit(); !committed) return forward(committed);
  return true;
}

Result<std::vector<std::int64_t>> CaseStore::remove_expired(std::chrono::seconds term) {
  const std::lock_guard blobs_lock(blobs_mutex_);
  const std::lock_guard lock(mutex_);
  // ISO 8601 of one time zone sorts as the times do.
  const std::string before = to_iso8601(clock_.utc_now() - term);
  const auto all = cases();
  if (!all) return forward(all);
  std::vector<std::int64_t> removed;
  Transaction transaction(database_);
  for (const Case& row : *all) {
    const bool expired = row.verified && *row.verified <= before;
    const bool at_work = row.state == CaseState::scanning || row.state == CaseState::building;
    if (!expired || at_work || row.hold || row.removed) continue;
    if (auto gone = database_
                        .statement("DELETE FROM files WHERE job IN "
                                   "(SELECT id FROM jobs WHERE case_id = ?)")
                        .bind(row.id)
                        .done();
        !gone) {
      return forward(gone);
    }
    if (auto marked = database_.statement("UPDATE cases SET removed = ? WHERE id = ?")
                          .bind(now())
                          .bind(row.id)
                          .done();
        !marked) {
      return forward(marked);
    }
    if (auto noted = note(row.id, "files deleted: verified " + *row.verified); !noted) {
      return forward(noted);
    }
    removed.push_back(row.id);
  }
  if (auto committed = transaction.commit(); !committed) return forward(committed);
  // Rows first: a crash in between leaves blobs that no row names, and the next start removes them.
  if (auto swept = remove_unnamed_blobs(); !swept) return forward(swept);
  return removed;
}

std::vector<std::string> CaseStore::damage(bool thorough) {
  const std::lock_guard blobs_lock(blobs_mutex_);
  std::vector<std::string> found;
  std::vector<ArtifactFile> all;
  {
    const std::lock_guard lock(mutex_);
    if (std::string wrong = database_.damage(); !wrong.empty()) found.push_back(std::move(wrong));
    Statement query = database_.statement("SELECT path, sha256, bytes FROM files");
    while (query.next()) {
      std::string path = query.text();
      std::string sha256 = query.text();
      all.push_back(
          {std::move(path), std::move(sha256), static_cast<std::uint64_t>(query.integer())});
    }
    if (auto read = query.done(); !read) found.push_back(read.error().message());
  }
  for (const ArtifactFile& file : all) {
    if (auto sound = blobs_.check(file, thorough); !sound) found.push_back(sound.error().message());
  }
  return found;
}

Result<std::vector<std::string>> CaseStore::check_case(std::int64_t case_id,
                                                       const std::stop_token& stop) {
  const auto all = jobs(case_id);
  if (!all) return forward(all);
  std::vector<std::string> found;
  for (const Job& job : *all) {
    const auto list = files(job.id);
    if (!list) return forward(list);
    for (const ArtifactFile& file : *list) {
      if (stop.stop_requested()) return found;
      if (blobs_.check(file, true)) continue;
      // Again while nothing is taken in or deleted: a scan must not wait for the reading of all.
      const std::lock_guard blobs_lock(blobs_mutex_);
      const auto still = files(job.id);
      if (!still) return forward(still);
      const auto sound = blobs_.check(file, true);
      if (sound || std::ranges::find(*still, file) == still->end()) continue;
      found.push_back(sound.error().message());
      if (auto noted = note_once(case_id, found.back()); !noted) return forward(noted);
    }
  }
  return found;
}

}  // namespace skullstation
