#include "daemon/http/approvals.h"

#include <fmt/format.h>

namespace skullstation {

Result<std::unique_ptr<Approvals>> Approvals::open(const std::filesystem::path& file,
                                                   const Clock& clock) {
  auto database = Database::open(file);
  if (!database) return forward(database);
  if (auto made = database->execute("CREATE TABLE IF NOT EXISTS approvals (job INTEGER PRIMARY "
                                    "KEY, account TEXT NOT NULL, time TEXT NOT NULL, note TEXT "
                                    "NOT NULL)");
      !made) {
    return forward(made);
  }
  return std::unique_ptr<Approvals>(new Approvals(*std::move(database), clock));
}

Result<void> Approvals::approve(std::int64_t job, const std::string& by, const std::string& note) {
  const auto before = of(job);
  if (!before) return forward(before);
  if (*before) {
    return fail(ErrorKind::usage, fmt::format("job {}", job),
                fmt::format("was approved by {} on {}", (*before)->by, (*before)->time));
  }
  const std::lock_guard lock(mutex_);
  return database_.statement("INSERT INTO approvals (job, account, time, note) VALUES (?, ?, ?, ?)")
      .bind(job)
      .bind(by)
      .bind(to_iso8601(clock_.utc_now()))
      .bind(note)
      .done();
}

Result<std::optional<Approval>> Approvals::of(std::int64_t job) {
  const std::lock_guard lock(mutex_);
  Statement query = database_.statement("SELECT account, time, note FROM approvals WHERE job = ?");
  query.bind(job);
  if (!query.next()) {
    if (auto read = query.done(); !read) return forward(read);
    return std::nullopt;
  }
  Approval found{job, query.text(), {}, {}};
  found.time = query.text();
  found.note = query.text();
  return found;
}

Result<std::vector<Approval>> Approvals::all() {
  const std::lock_guard lock(mutex_);
  std::vector<Approval> found;
  Statement query =
      database_.statement("SELECT job, account, time, note FROM approvals ORDER BY job");
  while (query.next()) {
    Approval& approval = found.emplace_back();
    approval.job = query.integer();
    approval.by = query.text();
    approval.time = query.text();
    approval.note = query.text();
  }
  if (auto read = query.done(); !read) return forward(read);
  return found;
}

Result<void> seal_approved(Approvals& approvals, StationService& service) {
  const auto all = approvals.all();
  if (!all) return forward(all);
  for (const Approval& approval : *all) {
    auto sealed = service.seal(approval.job, approval.by);
    // Made anew since, or deleted: nothing is to be sealed.
    if (!sealed && sealed.error().kind != ErrorKind::usage) return sealed;
  }
  return {};
}

}  // namespace skullstation
