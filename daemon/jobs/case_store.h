#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/database/database.h"
#include "daemon/jobs/blob_store.h"
#include "daemon/jobs/step_chain.h"

namespace skullstation {

enum class JobState { waiting, running, done, failed, cancelled };

/// One step of one case, made once. Its artifact never changes; a step that is made again with
/// other options is another job.
struct Job {
  std::int64_t id = 0;
  std::int64_t case_id = 0;
  std::string step;
  std::string options;  ///< JSON
  JobState state = JobState::waiting;
  int interruptions = 0;  ///< how often a crash or power cut ended it; it began again each time
  std::string created, started, ended;  ///< UTC, ISO 8601; empty: not yet
  double seconds = 0.0;                 ///< from start to end
  double cpu_seconds = 0.0;
  double peak_mib = 0.0;                       ///< resident memory
  std::string version;                         ///< of the program that made it
  std::string error;                           ///< for a person; empty unless failed
  std::string log;                             ///< the end of what the step printed
  std::string figures;                         ///< JSON that the step reported
  std::map<std::string, std::int64_t> inputs;  ///< name to the job whose artifact it reads
};

enum class CaseState { scanning, building, done, failed, cancelled };

struct Case {
  std::int64_t id = 0;
  std::string number;  ///< as people call it; need not be unique
  std::string created;
  int priority = 0;                     ///< the higher, the earlier
  std::optional<std::string> hold;      ///< why it must not be deleted
  std::optional<std::string> verified;  ///< when every delivery of it had been verified
  std::optional<std::string> removed;   ///< when its files were deleted
  CaseState state = CaseState::scanning;
};

/// Something that happened to a case.
struct CaseEvent {
  std::string time;  ///< UTC, ISO 8601
  std::string what;
};

/// Which cases, the newest first.
struct CaseSearch {
  std::string number;  ///< a part of it, in upper or lower case; empty: any
  int most = 50;
  int skipped = 0;
};

struct FoundCases {
  std::vector<Case> cases;
  std::int64_t all = 0;  ///< how many there are, shown or not
};

/// What a step used and said when it ended.
struct StepOutcome {
  JobState state = JobState::done;  ///< done, failed or cancelled
  double seconds = 0.0;
  double cpu_seconds = 0.0;
  double peak_mib = 0.0;
  std::string error, log, figures;
};

/// Cases, their jobs and their files: a SQLite database and a blob store in one folder. What a call
/// has acknowledged survives a crash at any moment: files are on the disk before the row that names
/// them is committed. One process at a time; safe from any thread.
class CaseStore {
 public:
  /// Opens or makes it; removes what no row names. Jobs that were running when the process died
  /// wait again. Errors (bad_input): used by another process, made by a newer version, damaged.
  static Result<std::unique_ptr<CaseStore>> open(const std::filesystem::path& folder,
                                                 const Clock& clock, std::string version);
  ~CaseStore();

  // -- scans ------------------------------------------------------------------------------------

  /// A new case whose pictures are about to be taken.
  Result<Case> begin_scan(const std::string& number);
  /// The case whose scan was begun and neither saved nor given up.
  Result<std::optional<Case>> unfinished_scan();
  /// Where its session is recorded until then.
  std::filesystem::path scan_folder(std::int64_t case_id) const;
  /// Takes the session in as the scan's artifact and appoints the chain's jobs. When it returns the
  /// case is saved.
  Result<void> save_scan(std::int64_t case_id, const StepChain& chain);
  /// No more pictures; those that were taken stay in their folder.
  Result<void> give_up_scan(std::int64_t case_id);

  // -- what a person may do ---------------------------------------------------------------------

  /// A failed or cancelled job waits again. Error (usage): it is neither, or has been made anew.
  Result<void> retry(std::int64_t job);
  /// A job that waits does so no longer. Error (usage): it does not wait.
  Result<void> cancel_waiting(std::int64_t job);
  /// Makes a step anew with these options (JSON), and every later step after it with the options it
  /// had, but for those that the chain leaves to a person's approval. What was made before stays;
  /// the case is no longer verified. Error (usage): the step is running, or was never appointed.
  Result<std::int64_t> rerun(std::int64_t case_id, const std::string& step,
                             const std::string& options, const StepChain& chain = {});
  /// Appoints a step that reads the case's present jobs, once for each set of them: another call
  /// gives the same job. Error (usage): one of them is not done.
  Result<std::int64_t> appoint_on_approval(std::int64_t case_id, const StepKind& kind,
                                           const std::string& options);
  Result<void> set_priority(std::int64_t case_id, int priority);
  /// A reason holds the case back from deletion; nothing lets it go.
  Result<void> set_hold(std::int64_t case_id, const std::optional<std::string>& reason);
  /// Every delivery of what this job made has been verified, now. False, and nothing changes, where
  /// the case has been made anew since: then something else is to be delivered.
  Result<bool> set_verified(std::int64_t case_id, std::int64_t job);

  // -- the engine's part ------------------------------------------------------------------------

  /// The job to make next: of the highest priority, then of the oldest case, its inputs done.
  Result<std::optional<Job>> next_job();
  /// What runs, then what waits and can still come, in the order in which it will be made.
  Result<std::vector<Job>> outstanding();
  Result<void> start(std::int64_t job);
  /// Back to the queue, as if it had never begun.
  Result<void> put_back(std::int64_t job);
  /// Files first, then the row. `artifact` is the folder to take in if the job is done.
  Result<void> finish(std::int64_t job, const StepOutcome& outcome,
                      const std::filesystem::path& artifact);
  /// The files of a job, laid out in a new folder.
  Result<void> lay_out(std::int64_t job, const std::filesystem::path& to);

  // -- looking ----------------------------------------------------------------------------------

  Result<std::vector<Case>> cases();
  Result<FoundCases> find_cases(const CaseSearch& search);
  Result<Case> case_of(std::int64_t case_id);
  Result<std::vector<CaseEvent>> events(std::int64_t case_id);
  Result<std::vector<Job>> jobs(std::int64_t case_id);
  Result<Job> job(std::int64_t id);
  Result<std::vector<ArtifactFile>> files(std::int64_t job);
  /// The done jobs of this step whose cases are neither verified nor deleted, the oldest first.
  Result<std::vector<Job>> unverified(std::string_view step);
  std::filesystem::path blob(const ArtifactFile& file) const { return blobs_.path_of(file.sha256); }
  /// How long the last `most` successful runs of the step took [s]: those with the same options
  /// or, if there are none, all.
  Result<std::vector<double>> past_seconds(const std::string& step, const std::string& options,
                                           int most);

  // -- keeping ----------------------------------------------------------------------------------

  /// Deletes the files of every case that was delivered and verified at least `term` ago, is on no
  /// hold and has nothing outstanding. Its rows stay. Returns the cases.
  Result<std::vector<std::int64_t>> remove_expired(std::chrono::seconds term);
  /// Everything that is wrong: database, missing files and, if `thorough`, their content.
  std::vector<std::string> damage(bool thorough);
  /// Reads every file of a case and returns what is wrong with them; it is noted once in the case's
  /// events, too. Files that are deleted meanwhile are not damaged.
  Result<std::vector<std::string>> check_case(std::int64_t case_id, const std::stop_token& stop);

  const std::filesystem::path& folder() const { return folder_; }

 private:
  CaseStore(std::filesystem::path folder, const Clock& clock, std::string version, int lock,
            Database database, BlobStore blobs);
  Result<void> begin();
  Result<void> take_up_interrupted_jobs();
  Result<void> remove_unnamed_blobs();
  Result<std::int64_t> appoint(std::int64_t case_id, const std::string& step,
                               const std::string& options,
                               const std::map<std::string, std::int64_t>& inputs);
  Result<void> name_files(std::int64_t job, const std::vector<ArtifactFile>& files);
  Result<void> note(std::int64_t case_id, const std::string& what);
  Result<void> note_once(std::int64_t case_id, const std::string& what);
  Result<std::vector<Job>> jobs_where(const std::string& condition, std::int64_t value,
                                      const std::string& order = "id");
  Result<std::vector<Case>> cases_where(const std::string& condition, std::int64_t value);
  Result<std::optional<Job>> scan_of(std::int64_t case_id, JobState state);
  std::string now() const { return to_iso8601(clock_.utc_now()); }

  const std::filesystem::path folder_;
  const Clock& clock_;
  const std::string version_;
  const int lock_;
  std::mutex blobs_mutex_;      // held from the taking of files until their rows are there
  std::recursive_mutex mutex_;  // of the database; after blobs_mutex_ where both are held
  Database database_;
  const BlobStore blobs_;
};

const char* to_string(JobState state);
const char* to_string(CaseState state);

/// The job of each step that counts: the one appointed last.
std::vector<Job> current_jobs(const std::vector<Job>& jobs);

}  // namespace skullstation
