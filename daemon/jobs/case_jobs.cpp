// What happens to the jobs of a CaseStore.

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/file.h"
#include "daemon/jobs/case_store.h"

namespace skullstation {

namespace {

/// A job that was running this often when the station went down may be what takes it down.
constexpr int most_interruptions = 3;

/// Jobs that run, or wait and don't wait for what will not come: an input that failed, was
/// cancelled, or waits in vain itself.
constexpr const char* outstanding_jobs = R"(
step <> 'scan' AND (state = 'running' OR (state = 'waiting' AND id NOT IN (
  WITH RECURSIVE blocked (id) AS (
    SELECT inputs.job FROM inputs JOIN jobs AS source ON source.id = inputs.from_job
      WHERE source.state IN ('failed', 'cancelled')
    UNION
    SELECT inputs.job FROM inputs JOIN blocked ON inputs.from_job = blocked.id)
  SELECT id FROM blocked))) AND 0 = ?
)";
constexpr const char* order_of_making =
    "state = 'waiting', (SELECT -priority FROM cases WHERE cases.id = case_id), case_id, id";

JobState state_from(const std::string& text) {
  for (const JobState state :
       {JobState::waiting, JobState::running, JobState::done, JobState::failed}) {
    if (text == to_string(state)) return state;
  }
  return JobState::cancelled;
}

std::string job_words(const Job& job) { return fmt::format("job {} ({})", job.id, job.step); }

Result<void> check_kept(const Case& owner) {
  if (!owner.removed) return {};
  return fail(ErrorKind::usage, fmt::format("case {}", owner.id),
              "its files were deleted on " + *owner.removed);
}

}  // namespace

std::vector<Job> current_jobs(const std::vector<Job>& jobs) {
  std::map<std::string, Job> last;
  for (const Job& job : jobs) {
    if (const auto found = last.find(job.step); found == last.end() || found->second.id < job.id) {
      last[job.step] = job;
    }
  }
  std::vector<Job> current;
  current.reserve(last.size());
  for (const auto& [step, job] : last) current.push_back(job);
  std::ranges::sort(current, {}, &Job::id);
  return current;
}

Result<std::vector<Job>> CaseStore::jobs_where(const std::string& condition, std::int64_t value,
                                               const std::string& order) {
  const std::lock_guard lock(mutex_);
  std::vector<Job> found;
  Statement query = database_.statement(
      "SELECT id, case_id, step, options, state, interruptions, created, started, ended, seconds, "
      "cpu_seconds, peak_mib, version, error, log, figures FROM jobs WHERE " +
      condition + " ORDER BY " + order);
  query.bind(value);
  while (query.next()) {
    Job& job = found.emplace_back();
    job.id = query.integer();
    job.case_id = query.integer();
    job.step = query.text();
    job.options = query.text();
    job.state = state_from(query.text());
    job.interruptions = static_cast<int>(query.integer());
    job.created = query.text();
    job.started = query.text();
    job.ended = query.text();
    job.seconds = query.number();
    job.cpu_seconds = query.number();
    job.peak_mib = query.number();
    job.version = query.text();
    job.error = query.text();
    job.log = query.text();
    job.figures = query.text();
  }
  if (auto read = query.done(); !read) return forward(read);
  for (Job& job : found) {
    Statement inputs = database_.statement("SELECT name, from_job FROM inputs WHERE job = ?");
    inputs.bind(job.id);
    while (inputs.next()) {
      const std::string name = inputs.text();
      job.inputs[name] = inputs.integer();
    }
    if (auto read = inputs.done(); !read) return forward(read);
  }
  return found;
}

Result<std::vector<Job>> CaseStore::jobs(std::int64_t case_id) {
  return jobs_where("case_id = ?", case_id);
}

Result<Job> CaseStore::job(std::int64_t id) {
  auto found = jobs_where("id = ?", id);
  if (!found) return forward(found);
  if (found->empty())
    return fail(ErrorKind::usage, fmt::format("job {}", id), "there is no such job");
  return found->front();
}

Result<void> CaseStore::take_up_interrupted_jobs() {
  const std::lock_guard lock(mutex_);
  return database_.execute(fmt::format(
      "BEGIN IMMEDIATE;"
      "UPDATE jobs SET interruptions = interruptions + 1, state = 'waiting' "
      "WHERE state = 'running' AND step <> 'scan';"
      "UPDATE jobs SET state = 'failed', error = 'was interrupted {0} times: it may be what takes "
      "the station down; try it again with less (a lower quality), or ask the maker' "
      "WHERE state = 'waiting' AND interruptions >= {0};"
      "COMMIT;",
      most_interruptions));
}

Result<std::int64_t> CaseStore::appoint(std::int64_t case_id, const std::string& step,
                                        const std::string& options,
                                        const std::map<std::string, std::int64_t>& inputs) {
  if (auto made = database_
                      .statement("INSERT INTO jobs (case_id, step, options, state, created) "
                                 "VALUES (?, ?, ?, 'waiting', ?)")
                      .bind(case_id)
                      .bind(step)
                      .bind(options)
                      .bind(now())
                      .done();
      !made) {
    return forward(made);
  }
  const std::int64_t id = database_.last_id();
  for (const auto& [name, from] : inputs) {
    if (auto made = database_.statement("INSERT INTO inputs (job, name, from_job) VALUES (?, ?, ?)")
                        .bind(id)
                        .bind(name)
                        .bind(from)
                        .done();
        !made) {
      return forward(made);
    }
  }
  return id;
}

Result<std::vector<Job>> CaseStore::outstanding() {
  return jobs_where(outstanding_jobs, 0, order_of_making);
}

Result<std::optional<Job>> CaseStore::next_job() {
  const std::lock_guard lock(mutex_);
  const auto waiting = outstanding();
  if (!waiting) return forward(waiting);
  for (const Job& candidate : *waiting) {
    if (candidate.state == JobState::running) return std::nullopt;  // one heavy step at a time
    const bool ready = std::ranges::all_of(candidate.inputs, [&](const auto& input) {
      const auto source = job(input.second);
      return source && source->state == JobState::done;
    });
    if (ready) return candidate;
  }
  return std::nullopt;
}

Result<void> CaseStore::start(std::int64_t job) {
  const std::lock_guard lock(mutex_);
  if (auto set = database_
                     .statement("UPDATE jobs SET state = 'running', started = ?, version = ?, "
                                "error = '' WHERE id = ? AND state = 'waiting'")
                     .bind(now())
                     .bind(version_)
                     .bind(job)
                     .done();
      !set) {
    return set;
  }
  if (database_.changed_rows() == 1) return {};
  return fail(ErrorKind::usage, fmt::format("job {}", job), "no longer waits");
}

Result<void> CaseStore::put_back(std::int64_t job) {
  const std::lock_guard lock(mutex_);
  return database_.statement("UPDATE jobs SET state = 'waiting' WHERE id = ? AND state = 'running'")
      .bind(job)
      .done();
}

Result<void> CaseStore::finish(std::int64_t job_id, const StepOutcome& outcome,
                               const std::filesystem::path& artifact) {
  const std::lock_guard blobs_lock(blobs_mutex_);
  std::vector<ArtifactFile> taken;
  if (outcome.state == JobState::done) {
    auto files = blobs_.take(artifact);
    if (!files) return forward(files);
    taken = *std::move(files);
  }
  const std::lock_guard lock(mutex_);
  const auto ending = job(job_id);
  if (!ending) return forward(ending);
  Transaction transaction(database_);
  if (auto named = name_files(job_id, taken); !named) return named;
  if (auto set = database_
                     .statement("UPDATE jobs SET state = ?, ended = ?, seconds = ?, "
                                "cpu_seconds = ?, peak_mib = ?, error = ?, log = ?, figures = ? "
                                "WHERE id = ? AND state = 'running'")
                     .bind(std::string_view(to_string(outcome.state)))
                     .bind(now())
                     .bind(outcome.seconds)
                     .bind(outcome.cpu_seconds)
                     .bind(outcome.peak_mib)
                     .bind(outcome.error)
                     .bind(outcome.log)
                     .bind(outcome.figures)
                     .bind(job_id)
                     .done();
      !set) {
    return set;
  }
  std::string what = fmt::format("{} {}", job_words(*ending), to_string(outcome.state));
  if (!outcome.error.empty()) what += ": " + outcome.error;
  if (auto noted = note(ending->case_id, what); !noted) return noted;
  return transaction.commit();
}

Result<void> CaseStore::cancel_waiting(std::int64_t id) {
  const std::lock_guard lock(mutex_);
  const auto waiting = job(id);
  if (!waiting) return forward(waiting);
  if (waiting->state != JobState::waiting) {
    return fail(
        ErrorKind::usage, job_words(*waiting),
        fmt::format("is {}; only a job that waits can be taken back", to_string(waiting->state)));
  }
  Transaction transaction(database_);
  if (auto set = database_.statement("UPDATE jobs SET state = 'cancelled', ended = ? WHERE id = ?")
                     .bind(now())
                     .bind(id)
                     .done();
      !set) {
    return set;
  }
  if (auto noted = note(waiting->case_id, job_words(*waiting) + " cancelled"); !noted) return noted;
  return transaction.commit();
}

Result<void> CaseStore::retry(std::int64_t id) {
  const std::lock_guard lock(mutex_);
  const auto ended = job(id);
  if (!ended) return forward(ended);
  if (ended->step == scan_step ||
      (ended->state != JobState::failed && ended->state != JobState::cancelled)) {
    return fail(ErrorKind::usage, job_words(*ended),
                fmt::format("is {}; only a failed or cancelled step can be tried again",
                            to_string(ended->state)),
                "to make it with other options, rerun it");
  }
  const auto owner = case_of(ended->case_id);
  if (!owner) return forward(owner);
  if (auto kept = check_kept(*owner); !kept) return kept;
  const auto all = jobs(ended->case_id);
  if (!all) return forward(all);
  for (const Job& current : current_jobs(*all)) {
    if (current.step == ended->step && current.id != id) {
      return fail(ErrorKind::usage, job_words(*ended),
                  fmt::format("has been appointed anew as job {}", current.id), "retry that one");
    }
  }
  Transaction transaction(database_);
  if (auto set = database_
                     .statement("UPDATE jobs SET state = 'waiting', interruptions = 0, error = '', "
                                "ended = '' WHERE id = ?")
                     .bind(id)
                     .done();
      !set) {
    return set;
  }
  if (auto noted = note(ended->case_id, job_words(*ended) + " tried again"); !noted) return noted;
  return transaction.commit();
}

Result<std::int64_t> CaseStore::rerun(std::int64_t case_id, const std::string& step,
                                      const std::string& options, const StepChain& chain) {
  const std::lock_guard lock(mutex_);
  const auto owner = case_of(case_id);
  if (!owner) return forward(owner);
  const auto all = jobs(case_id);
  if (!all) return forward(all);
  const std::string where = fmt::format("case {}, step \"{}\"", case_id, step);
  if (auto kept = check_kept(*owner); !kept) return forward(kept);
  // A job's inputs have smaller numbers than itself, so one pass finds all that stands on the step.
  std::map<std::int64_t, std::int64_t> anew;  // old job to its successor
  Transaction transaction(database_);
  for (const Job& old : current_jobs(*all)) {
    if (old.step == scan_step) continue;
    const auto kind = std::ranges::find(chain, old.step, &StepKind::name);
    if (kind != chain.end() && kind->on_approval) continue;
    const bool stands_on_it = std::ranges::any_of(
        old.inputs, [&](const auto& input) { return anew.contains(input.second); });
    if (old.step != step && !stands_on_it) continue;
    if (old.state == JobState::running) {
      return fail(ErrorKind::usage, where, job_words(old) + " is running", "cancel it first");
    }
    if (old.state == JobState::waiting) {
      if (auto set = database_.statement("UPDATE jobs SET state = 'cancelled' WHERE id = ?")
                         .bind(old.id)
                         .done();
          !set) {
        return forward(set);
      }
    }
    std::map<std::string, std::int64_t> inputs = old.inputs;
    for (auto& [name, from] : inputs) {
      if (const auto successor = anew.find(from); successor != anew.end()) from = successor->second;
    }
    const auto id = appoint(case_id, old.step, old.step == step ? options : old.options, inputs);
    if (!id) return forward(id);
    anew[old.id] = *id;
  }
  if (anew.empty()) {
    return fail(ErrorKind::usage, where, "this case has no such step");
  }
  const std::int64_t first = anew.begin()->second;
  if (auto set =
          database_.statement("UPDATE cases SET verified = NULL WHERE id = ?").bind(case_id).done();
      !set) {
    return forward(set);
  }
  if (auto noted = note(case_id, fmt::format("{} appointed anew as job {}", step, first)); !noted) {
    return forward(noted);
  }
  if (auto committed = transaction.commit(); !committed) return forward(committed);
  return first;
}

Result<std::int64_t> CaseStore::appoint_on_approval(std::int64_t case_id, const StepKind& kind,
                                                    const std::string& options) {
  const std::lock_guard lock(mutex_);
  const auto owner = case_of(case_id);
  if (!owner) return forward(owner);
  if (auto kept = check_kept(*owner); !kept) return forward(kept);
  const auto all = jobs(case_id);
  if (!all) return forward(all);
  std::map<std::string, std::int64_t> inputs;
  for (const Job& job : current_jobs(*all)) {
    if (std::ranges::find(kind.inputs, job.step) == kind.inputs.end()) continue;
    if (job.state != JobState::done) {
      return fail(ErrorKind::usage, job_words(job),
                  fmt::format("is {}; \"{}\" needs it done", to_string(job.state), kind.name));
    }
    inputs[job.step] = job.id;
  }
  if (inputs.size() != kind.inputs.size()) {
    return fail(ErrorKind::usage, fmt::format("case {}", case_id),
                fmt::format("lacks a step that \"{}\" needs", kind.name));
  }
  for (const Job& job : *all) {
    if (job.step == kind.name && job.inputs == inputs) return job.id;
  }
  Transaction transaction(database_);
  auto id = appoint(case_id, kind.name, options, inputs);
  if (!id) return id;
  if (auto noted = note(case_id, fmt::format("{} appointed as job {}", kind.name, *id)); !noted) {
    return forward(noted);
  }
  if (auto committed = transaction.commit(); !committed) return forward(committed);
  return id;
}

Result<std::vector<Job>> CaseStore::unverified(std::string_view step) {
  return jobs_where(fmt::format("step = '{}' AND state = 'done' AND 0 = ? AND case_id IN "
                                "(SELECT id FROM cases WHERE verified IS NULL AND removed IS NULL)",
                                step),
                    0);
}

Result<std::vector<double>> CaseStore::past_seconds(const std::string& step,
                                                    const std::string& options, int most) {
  const std::lock_guard lock(mutex_);
  std::vector<double> past;
  for (const char* which : {"options = ?", "options = ? OR 1"}) {
    Statement query = database_.statement(
        fmt::format("SELECT seconds FROM jobs WHERE step = ? AND ({}) AND state = 'done' "
                    "ORDER BY id DESC LIMIT ?",
                    which));
    query.bind(step).bind(options).bind(std::int64_t{most});
    while (query.next()) past.push_back(query.number());
    if (auto read = query.done(); !read) return forward(read);
    if (!past.empty()) break;
  }
  return past;
}

}  // namespace skullstation
