#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/result.h"
#include "daemon/jobs/case_store.h"
#include "daemon/jobs/step_chain.h"

namespace skullstation {

struct EngineOptions {
  StepChain chain;
  /// Program and first words of a step: {"/usr/bin/skullstation", "step"}. The step's name and its
  /// working folder follow (docs/station.md).
  std::vector<std::string> step_command;
  int threads = 0;  ///< of a step; 0: all
  std::uint64_t seed = 1;
  std::chrono::milliseconds grace{5000};         ///< for a step that is told to end
  std::chrono::milliseconds retry_pause{10000};  ///< when the disk is full or the database fails
};

enum class JobNews {
  begun,        ///< of a job
  case_done,    ///< the last step of its chain is made
  case_failed,  ///< one of its steps failed
  all_ended,    ///< nothing runs or waits any more
};

/// What the running step said last.
struct StepProgress {
  std::int64_t job = 0;
  std::int64_t case_id = 0;
  std::string step;
  double fraction = 0.0;
  std::string stage;
  double seconds = 0.0;  ///< since it began
};

/// Makes the jobs of a CaseStore, one at a time, each in a process of its own. A job that the end
/// of this program interrupts begins anew when it is started again.
class JobEngine {
 public:
  using Tell = std::function<void(JobNews, std::int64_t case_id)>;

  /// Begins at once. `tell` is called from the engine's thread and must not block.
  JobEngine(CaseStore& store, EngineOptions options, Tell tell);
  ~JobEngine();  ///< ends the running step, which goes back to the queue
  JobEngine(const JobEngine&) = delete;
  JobEngine& operator=(const JobEngine&) = delete;

  /// Something has been appointed, or space been freed.
  void wake();
  /// Takes a waiting job back or ends the running one. Error (usage): it has ended already.
  Result<void> cancel(std::int64_t job);

  std::optional<StepProgress> progress() const;
  /// Why nothing is made although something waits; empty if all is well.
  std::string trouble() const;
  /// How long until the case is done, by what this station's earlier runs of the same steps took
  /// (their median), what is before it in the queue included. Nothing where a step was never made
  /// here.
  Result<std::optional<std::chrono::seconds>> time_left(std::int64_t case_id) const;

 private:
  void run(const std::stop_token& stop);
  void make(const Job& job, const std::stop_token& stop);
  std::filesystem::path work_folder(const Job& job) const;
  Result<void> prepare(const Job& job, const StepKind& kind,
                       const std::filesystem::path& folder) const;
  StepOutcome execute(const Job& job, const std::filesystem::path& folder,
                      const std::stop_token& stop);
  void tell_outcome(const Job& job, JobState state);
  Result<void> check_space(const Job& job) const;
  const StepKind* kind_of(const std::string& step) const;
  void set_trouble(std::string words);
  void pause(const std::stop_token& stop);

  CaseStore& store_;
  const EngineOptions options_;
  const Tell tell_;

  mutable std::mutex mutex_;  // guards what follows
  std::condition_variable_any changed_;
  bool woken_ = false;
  std::optional<StepProgress> progress_;
  std::chrono::steady_clock::time_point begun_;
  std::stop_source step_stop_;
  bool cancelled_ = false;  // the running job, by a person
  std::string trouble_;

  std::jthread thread_;  // last: it uses everything above
};

}  // namespace skullstation
