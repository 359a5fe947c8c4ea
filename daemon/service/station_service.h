#pragma once

#include <condition_variable>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/jobs/case_store.h"
#include "daemon/jobs/job_engine.h"
#include "daemon/station/state_table.h"
#include "daemon/station/station.h"
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
  void tell(StationEvent event);
  /// Of the next scan; without one it is made of the date and a running number.
  void set_case_number(std::string number);
  StationStatus status() const;

  CaseStore& store() { return *store_; }
  JobEngine& engine() { return *engine_; }
  /// The hands at a simulated station; null at a real one, or while it is not open.
  SimulatedStation* simulated() const;

 private:
  explicit StationService(const ServiceOptions& options) : options_(options) {}

  void walk(StationEvent event);
  void act(StationAction action);
  void open_parts(bool reset);
  Result<bool> scan_to_resume();
  void scan(bool resume);
  Result<std::optional<Case>> begin_case();
  Result<void> ask_for_placement(const PlacementRequest& request, const std::stop_token& stop);
  void watch_button(const std::stop_token& stop);
  void watch_cameras(const std::stop_token& stop);
  void remove_expired();
  void say(std::string message);
  Station* station() const;
  /// Runs the work after the one before it has ended.
  void work(std::function<void()> task);

  const ServiceOptions options_;
  SystemClock clock_;
  StepChain chain_;
  std::unique_ptr<CaseStore> store_;

  mutable std::mutex mutex_;  // guards what follows, up to the threads
  std::condition_variable_any changed_;
  std::deque<StationEvent> events_;
  StationStatus status_;
  std::string next_number_;
  std::unique_ptr<Station> station_;  // set once; its parts are safe for their own threads
  bool confirmed_ = false;            // the placement, by a person
  bool given_up_ = false;             // the scan, by a person
  std::stop_source scan_stop_;

  std::mutex cameras_mutex_;  // held by whoever takes pictures
  std::jthread worker_;       // opens the station, scans
  std::jthread button_;
  std::jthread cameras_;
  std::unique_ptr<JobEngine> engine_;  // last: it tells this object
};

}  // namespace skullstation
