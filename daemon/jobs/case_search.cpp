// What the store tells of its cases.

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <utility>

#include "daemon/jobs/case_store.h"

namespace skullstation {

Result<std::vector<Case>> CaseStore::cases_where(const std::string& condition, std::int64_t value) {
  const std::lock_guard lock(mutex_);
  std::vector<Case> found;
  Statement query = database_.statement(
      "SELECT id, number, created, priority, hold, verified, removed FROM cases WHERE " +
      condition + " ORDER BY id");
  if (condition.find('?') != std::string::npos) query.bind(value);
  while (query.next()) {
    Case& row = found.emplace_back();
    row.id = query.integer();
    row.number = query.text();
    row.created = query.text();
    row.priority = static_cast<int>(query.integer());
    row.hold = query.optional_text();
    row.verified = query.optional_text();
    row.removed = query.optional_text();
  }
  if (auto read = query.done(); !read) return forward(read);
  for (Case& row : found) {
    const auto all = jobs(row.id);
    if (!all) return forward(all);
    row.state = CaseState::done;
    const auto any = [&](JobState state, bool scan) {
      return std::ranges::any_of(current_jobs(*all), [&](const Job& job) {
        return job.state == state && (job.step == scan_step) == scan;
      });
    };
    if (any(JobState::running, true)) {
      row.state = CaseState::scanning;
    } else if (any(JobState::failed, false)) {
      row.state = CaseState::failed;
    } else if (any(JobState::cancelled, true) || any(JobState::cancelled, false)) {
      row.state = CaseState::cancelled;
    } else if (any(JobState::waiting, false) || any(JobState::running, false)) {
      row.state = CaseState::building;
    }
  }
  return found;
}

Result<std::vector<Case>> CaseStore::cases() { return cases_where("1", 0); }

Result<FoundCases> CaseStore::find_cases(const CaseSearch& search) {
  const std::lock_guard lock(mutex_);
  FoundCases found;
  {
    Statement query = database_.statement(
        "SELECT COUNT(*) FROM cases WHERE instr(lower(number), lower(?)) OR ? = ''");
    query.bind(search.number).bind(search.number);
    if (query.next()) found.all = query.integer();
    if (auto read = query.done(); !read) return forward(read);
  }
  std::vector<std::int64_t> ids;
  Statement query = database_.statement(
      "SELECT id FROM cases WHERE instr(lower(number), lower(?)) OR ? = '' "
      "ORDER BY id DESC LIMIT ? OFFSET ?");
  query.bind(search.number).bind(search.number);
  query.bind(std::int64_t{search.most}).bind(std::int64_t{search.skipped});
  while (query.next()) ids.push_back(query.integer());
  if (auto read = query.done(); !read) return forward(read);
  for (const std::int64_t id : ids) {
    auto row = case_of(id);
    if (!row) return forward(row);
    found.cases.push_back(*std::move(row));
  }
  return found;
}

Result<std::vector<CaseEvent>> CaseStore::events(std::int64_t case_id) {
  const std::lock_guard lock(mutex_);
  std::vector<CaseEvent> found;
  Statement query =
      database_.statement("SELECT utc, what FROM events WHERE case_id = ? ORDER BY sequence");
  query.bind(case_id);
  while (query.next()) {
    CaseEvent& event = found.emplace_back();
    event.time = query.text();
    event.what = query.text();
  }
  if (auto read = query.done(); !read) return forward(read);
  return found;
}

Result<Case> CaseStore::case_of(std::int64_t case_id) {
  auto found = cases_where("id = ?", case_id);
  if (!found) return forward(found);
  if (found->empty()) {
    return fail(ErrorKind::usage, fmt::format("case {}", case_id), "there is no such case");
  }
  return found->front();
}

}  // namespace skullstation
