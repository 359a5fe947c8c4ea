#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/delivery/outbox.h"
#include "daemon/jobs/case_store.h"
#include "daemon/jobs/job_engine.h"
#include "daemon/service/camera_preview.h"
#include "daemon/station/state_table.h"
#include "daemon/station/station.h"
#include "daemon/station/station_check.h"
#include "daemon/station/station_config.h"

namespace skullstation {

struct ServiceOptions {
  StationConfig config;
  std::vector<std::string> step_command;  ///< EngineOptions
  std::string version;
  int threads = 0;
  std::uint64_t seed = 1;
};

/// What whoever looks at the station is told.
struct StationStatus {
  StationState state = StationState::starting;
  Signal signal = Signal::working;
  std::string message;                   ///< for the person at the table
  std::optional<std::int64_t> scanning;  ///< the case whose pictures are being taken
  double scan_fraction = 0.0;
  std::string scan_stage;
};

/// Something that happened at the station, in words.
struct LogLine {
  std::uint64_t number = 0;  ///< counts from 1 since the start
  std::string time;          ///< UTC, ISO 8601
  std::string words;
};

/// The running station: looks every event up in the state table (daemon/station/state_table.h) and
/// carries out the action. Events come from the button, the interlock, cameras, scan and jobs on
/// threads of their own; the table is walked on one.
class StationService {
 public:
  /// Opens the store and takes up the jobs. The station itself is opened by run().
  static Result<std::unique_ptr<StationService>> open(const ServiceOptions& options);
  ~StationService();

  /// Until shut_down is told, or `stop` is requested. `alive` is called at least every second.
  void run(const std::stop_token& stop, const std::function<void()>& alive);

  /// Safe from any thread; what means nothing in the present state does nothing.
  void tell(StationEvent event) { tell(event, std::nullopt); }
  /// The same if the station is in this state when the event's turn comes: what a person saw on a
  /// screen may be over, and "go" must not mean something else by then.
  void tell(StationEvent event, std::optional<StationState> only_in);
  /// Of the next scan; without one it is made of the date and a running number.
  void set_case_number(std::string number);
  StationStatus status() const;
  /// The lines after this number; of older ones than the last 500 nothing is known.
  std::vector<LogLine> log_after(std::uint64_t number) const;
  /// What a camera sees now or, while it is at work, saw last. Errors: usage (no such camera),
  /// hardware (not open, at work and never looked through, failed).
  Result<CameraPreview> preview(const std::string& camera);
  /// The computer and the open station, as `skullstation doctor` sees them.
  std::vector<Finding> check();
  /// What is wrong with a case's files, as far as they have been read since the start.
  std::vector<std::string> damage_of(std::int64_t case_id) const;

  CaseStore& store() { return *store_; }
  JobEngine& engine() { return *engine_; }
  /// Where sealed cases are on their way (sealed_cases.h).
  Outbox& outbox() { return *outbox_; }
  /// Has a case sealed with this result of it, in the name of who approved that; once, however
  /// often it is asked for. Error (usage): it is not its case's present result, or its files were
  /// deleted.
  Result<void> seal(std::int64_t result_job, const std::string& approved_by);
  const StepChain& chain() const { return chain_; }
  const StationConfig& config() const { return options_.config; }
  const std::string& version() const { return options_.version; }
  const Clock& clock() const { return clock_; }
  /// The hands at a simulated station; null at a real one, or while it is not open.
  SimulatedStation* simulated() const;

 private:
  explicit StationService(const ServiceOptions& options) : options_(options) {}

  /// An event, and the only state in which it counts, if it was told so.
  struct ToldEvent {
    StationEvent event;
    std::optional<StationState> only_in;
  };

  void walk(const ToldEvent& told);
  void act(StationAction action);
  void open_parts(bool reset);
  Result<bool> scan_to_resume();
  void scan(bool resume);
  Result<std::optional<Case>> begin_case();
  Result<void> ask_for_placement(const PlacementRequest& request, const std::stop_token& stop);
  void watch_button(const std::stop_token& stop);
  void watch_cameras(const std::stop_token& stop);
  void watch_files(const std::stop_token& stop);
  void remove_expired();
  void say(std::string message);
  void log(std::string words);
  Station* station() const;
  /// Runs the work after the one before it has ended.
  void work(std::function<void()> task);

  const ServiceOptions options_;
  SystemClock clock_;
  StepChain chain_;
  std::unique_ptr<CaseStore> store_;
  std::unique_ptr<Outbox> outbox_;

  mutable std::mutex mutex_;  // guards what follows, up to the threads
  std::condition_variable_any changed_;
  std::deque<ToldEvent> events_;
  std::deque<LogLine> log_;
  std::uint64_t logged_ = 0;
  StationStatus status_;
  std::string next_number_;
  std::map<std::int64_t, std::vector<std::string>> damage_;  // by case
  std::unique_ptr<Station> station_;  // set once; its parts are safe for their own threads
  bool confirmed_ = false;            // the placement, by a person
  bool given_up_ = false;             // the scan, by a person
  std::stop_source scan_stop_;

  std::mutex cameras_mutex_;  // held by whoever takes pictures
  CameraPreviews previews_;
  std::jthread worker_;  // opens the station, scans
  std::jthread button_;
  std::jthread cameras_;
  std::jthread files_;
  std::unique_ptr<JobEngine> engine_;  // last: it tells this object
};

}  // namespace skullstation
