#include "daemon/jobs/case_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <ctime>
#include <fstream>
#include <set>
#include <system_error>
#include <thread>
#include <utility>

#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

// The store itself: opening, scans and their files. What happens to jobs is in case_jobs.cpp, how
// cases are found in case_search.cpp, how long they are kept in case_keeping.cpp.

namespace {

constexpr int schema_version = 1;
constexpr const char* schema = R"(
CREATE TABLE cases (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  number TEXT NOT NULL,
  created TEXT NOT NULL,
  priority INTEGER NOT NULL DEFAULT 0,
  hold TEXT,
  verified TEXT,
  removed TEXT);
CREATE TABLE jobs (
  id INTEGER PRIMARY KEY AUTOINCREMENT,
  case_id INTEGER NOT NULL REFERENCES cases,
  step TEXT NOT NULL,
  options TEXT NOT NULL,
  state TEXT NOT NULL CHECK (state IN ('waiting', 'running', 'done', 'failed', 'cancelled')),
  interruptions INTEGER NOT NULL DEFAULT 0,
  created TEXT NOT NULL,
  started TEXT NOT NULL DEFAULT '',
  ended TEXT NOT NULL DEFAULT '',
  seconds REAL NOT NULL DEFAULT 0,
  cpu_seconds REAL NOT NULL DEFAULT 0,
  peak_mib REAL NOT NULL DEFAULT 0,
  version TEXT NOT NULL DEFAULT '',
  error TEXT NOT NULL DEFAULT '',
  log TEXT NOT NULL DEFAULT '',
  figures TEXT NOT NULL DEFAULT '');
CREATE INDEX jobs_of_case ON jobs (case_id);
-- One heavy step at a time, and one scan.
CREATE UNIQUE INDEX one_running ON jobs (step = 'scan') WHERE state = 'running';
CREATE TABLE inputs (
  job INTEGER NOT NULL REFERENCES jobs,
  name TEXT NOT NULL,
  from_job INTEGER NOT NULL REFERENCES jobs,
  PRIMARY KEY (job, name)) WITHOUT ROWID;
CREATE TABLE files (
  job INTEGER NOT NULL REFERENCES jobs,
  path TEXT NOT NULL,
  sha256 TEXT NOT NULL,
  bytes INTEGER NOT NULL,
  PRIMARY KEY (job, path)) WITHOUT ROWID;
CREATE TABLE events (
  sequence INTEGER PRIMARY KEY AUTOINCREMENT,
  utc TEXT NOT NULL,
  since_boot_s REAL NOT NULL,
  boot TEXT NOT NULL,
  case_id INTEGER,
  what TEXT NOT NULL);
)";

std::string boot_id() {
  std::ifstream file("/proc/sys/kernel/random/boot_id");
  std::string id;
  std::getline(file, id);
  return id;
}

double seconds_since_boot() {
  timespec time{};
  ::clock_gettime(CLOCK_BOOTTIME, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// The lock's descriptor; released by the kernel when the process ends, however it does.
Result<int> lock_folder(const fs::path& folder) {
  const fs::path file = folder / ".lock";
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    return fail(ErrorKind::bad_input, file.string(),
                fmt::format("can't be written ({})", std::system_category().message(errno)));
  }
  // A daemon that was just killed may have left a child that is still on its way out.
  for (int attempt = 0; ::flock(descriptor, LOCK_EX | LOCK_NB) != 0; ++attempt) {
    if (attempt == 100) {
      ::close(descriptor);
      return fail(ErrorKind::bad_input, folder.string(), "is used by another skullstationd",
                  "end that one, or choose another folder");
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return descriptor;
}

}  // namespace

const char* to_string(JobState state) {
  constexpr std::array names{"waiting", "running", "done", "failed", "cancelled"};
  return names[static_cast<std::size_t>(state)];
}

const char* to_string(CaseState state) {
  constexpr std::array names{"scanning", "building", "done", "failed", "cancelled"};
  return names[static_cast<std::size_t>(state)];
}

CaseStore::CaseStore(fs::path folder, const Clock& clock, std::string version, int lock,
                     Database database, BlobStore blobs)
    : folder_(std::move(folder)),
      clock_(clock),
      version_(std::move(version)),
      lock_(lock),
      database_(std::move(database)),
      blobs_(std::move(blobs)) {}

CaseStore::~CaseStore() { ::close(lock_); }

Result<std::unique_ptr<CaseStore>> CaseStore::open(const fs::path& folder, const Clock& clock,
                                                   std::string version) {
  if (auto made = make_writable_folder(folder); !made) return forward(made);
  const auto lock = lock_folder(folder);
  if (!lock) return forward(lock);
  auto blobs = BlobStore::open(folder / "blobs");
  auto database = Database::open(folder / "station.db");
  if (!blobs || !database) {
    ::close(*lock);
    return !blobs ? forward(blobs) : forward(database);
  }
  std::unique_ptr<CaseStore> store(new CaseStore(folder, clock, std::move(version), *lock,
                                                 *std::move(database), *std::move(blobs)));
  if (auto begun = store->begin(); !begun) return forward(begun);
  return store;
}

Result<void> CaseStore::begin() {
  if (const std::string damage = database_.damage(); !damage.empty()) {
    return fail(ErrorKind::bad_input, (folder_ / "station.db").string(), "is damaged: " + damage,
                "put back a copy of it");
  }
  if (auto ready = database_.make_tables(schema, schema_version); !ready) return ready;
  if (auto ready = take_up_interrupted_jobs(); !ready) return ready;
  if (auto ready = remove_unnamed_blobs(); !ready) return ready;
  std::error_code ignored;
  fs::remove_all(folder_ / "work", ignored);  // of steps that a crash ended
  return sync_folder(folder_);
}

Result<void> CaseStore::remove_unnamed_blobs() {
  std::set<std::string> named;
  Statement query = database_.statement("SELECT DISTINCT sha256 FROM files");
  while (query.next()) named.insert(query.text());
  if (auto read = query.done(); !read) return read;
  const auto removed = blobs_.remove_all_but(named);
  if (!removed) return forward(removed);
  return {};
}

/// Part of the surrounding transaction: an event is there if what it tells has happened.
Result<void> CaseStore::note(std::int64_t case_id, const std::string& what) {
  static const std::string boot = boot_id();
  return database_
      .statement(
          "INSERT INTO events (utc, since_boot_s, boot, case_id, what) VALUES (?, ?, ?, ?, ?)")
      .bind(now())
      .bind(seconds_since_boot())
      .bind(boot)
      .bind(case_id)
      .bind(what)
      .done();
}

Result<void> CaseStore::note_once(std::int64_t case_id, const std::string& what) {
  const std::lock_guard lock(mutex_);
  Statement noted = database_.statement("SELECT 1 FROM events WHERE case_id = ? AND what = ?");
  noted.bind(case_id).bind(what);
  if (noted.next()) return {};
  if (auto read = noted.done(); !read) return read;
  return note(case_id, what);
}

fs::path CaseStore::scan_folder(std::int64_t case_id) const {
  return folder_ / "scans" / fmt::format("{}", case_id);
}

Result<Case> CaseStore::begin_scan(const std::string& number) {
  const std::lock_guard lock(mutex_);
  Transaction transaction(database_);
  if (auto made = database_.statement("INSERT INTO cases (number, created) VALUES (?, ?)")
                      .bind(number)
                      .bind(now())
                      .done();
      !made) {
    return forward(made);
  }
  const std::int64_t id = database_.last_id();
  const auto scan = appoint(id, std::string(scan_step), "{}", {});
  if (!scan) return forward(scan);
  if (auto running =
          database_.statement("UPDATE jobs SET state = 'running', started = ? WHERE id = ?")
              .bind(now())
              .bind(*scan)
              .done();
      !running) {
    return forward(running);
  }
  if (auto noted = note(id, "scan begun: case " + number); !noted) return forward(noted);
  if (auto committed = transaction.commit(); !committed) return forward(committed);
  return case_of(id);
}

Result<std::optional<Job>> CaseStore::scan_of(std::int64_t case_id, JobState state) {
  const auto all = jobs(case_id);
  if (!all) return forward(all);
  for (const Job& job : *all) {
    if (job.step == scan_step && job.state == state) return job;
  }
  return std::nullopt;
}

Result<std::optional<Case>> CaseStore::unfinished_scan() {
  const std::lock_guard lock(mutex_);
  const auto scanning =
      cases_where("id IN (SELECT case_id FROM jobs WHERE step = 'scan' AND state = 'running')", 0);
  if (!scanning) return forward(scanning);
  if (scanning->empty()) return std::nullopt;
  return scanning->front();
}

Result<void> CaseStore::save_scan(std::int64_t case_id, const StepChain& chain) {
  const std::lock_guard blobs_lock(blobs_mutex_);
  const auto scan = scan_of(case_id, JobState::running);
  if (!scan) return forward(scan);
  if (!*scan)
    return fail(ErrorKind::usage, fmt::format("case {}", case_id), "is not being scanned");
  const auto taken = blobs_.take(scan_folder(case_id));
  if (!taken) return forward(taken);
  {
    const std::lock_guard lock(mutex_);
    Transaction transaction(database_);
    if (auto named = name_files((*scan)->id, *taken); !named) return named;
    if (auto done = database_
                        .statement("UPDATE jobs SET state = 'done', ended = ?, version = ? "
                                   "WHERE id = ?")
                        .bind(now())
                        .bind(version_)
                        .bind((*scan)->id)
                        .done();
        !done) {
      return done;
    }
    std::map<std::string, std::int64_t> made{{std::string(scan_step), (*scan)->id}};
    for (const StepKind& kind : chain) {
      if (kind.on_approval) continue;
      std::map<std::string, std::int64_t> inputs;
      for (const std::string& input : kind.inputs) inputs[input] = made.at(input);
      const auto id = appoint(case_id, kind.name, kind.options, inputs);
      if (!id) return forward(id);
      made[kind.name] = *id;
    }
    if (auto noted = note(case_id, fmt::format("scan saved: {} files", taken->size())); !noted) {
      return noted;
    }
    if (auto committed = transaction.commit(); !committed) return committed;
  }
  // The blobs hold the content now; a folder that stays is only a second name for it.
  std::error_code ignored;
  fs::remove_all(scan_folder(case_id), ignored);
  return {};
}

Result<void> CaseStore::give_up_scan(std::int64_t case_id) {
  const std::lock_guard lock(mutex_);
  const auto scan = scan_of(case_id, JobState::running);
  if (!scan) return forward(scan);
  if (!*scan)
    return fail(ErrorKind::usage, fmt::format("case {}", case_id), "is not being scanned");
  Transaction transaction(database_);
  if (auto done = database_.statement("UPDATE jobs SET state = 'cancelled', ended = ? WHERE id = ?")
                      .bind(now())
                      .bind((*scan)->id)
                      .done();
      !done) {
    return done;
  }
  if (auto noted = note(case_id, "scan given up"); !noted) return noted;
  return transaction.commit();
}

Result<void> CaseStore::name_files(std::int64_t job, const std::vector<ArtifactFile>& files) {
  for (const ArtifactFile& file : files) {
    if (auto named =
            database_.statement("INSERT INTO files (job, path, sha256, bytes) VALUES (?, ?, ?, ?)")
                .bind(job)
                .bind(file.path)
                .bind(file.sha256)
                .bind(static_cast<std::int64_t>(file.bytes))
                .done();
        !named) {
      return named;
    }
  }
  return {};
}

Result<std::vector<ArtifactFile>> CaseStore::files(std::int64_t job) {
  const std::lock_guard lock(mutex_);
  std::vector<ArtifactFile> found;
  Statement query =
      database_.statement("SELECT path, sha256, bytes FROM files WHERE job = ? ORDER BY path");
  query.bind(job);
  while (query.next()) {
    std::string path = query.text();
    std::string sha256 = query.text();
    found.push_back(
        {std::move(path), std::move(sha256), static_cast<std::uint64_t>(query.integer())});
  }
  if (auto read = query.done(); !read) return forward(read);
  return found;
}

Result<void> CaseStore::lay_out(std::int64_t job, const fs::path& to) {
  const auto list = files(job);
  if (!list) return forward(list);
  return blobs_.lay_out(*list, to);
}

Result<void> CaseStore::set_priority(std::int64_t case_id, int priority) {
  const std::lock_guard lock(mutex_);
  if (auto known = case_of(case_id); !known) return forward(known);
  return database_.statement("UPDATE cases SET priority = ? WHERE id = ?")
      .bind(std::int64_t{priority})
      .bind(case_id)
      .done();
}

}  // namespace skullstation
