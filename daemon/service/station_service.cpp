#include "daemon/service/station_service.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <malloc.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/file.h"
#include "core/session/session.h"
#include "daemon/service/sealed_cases.h"
#include "daemon/station/scan_workflow.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr auto door_open = "door open";

StepChain chain_of(const JobsConfig& jobs, const EvidenceConfig& evidence) {
  constexpr std::array quality{"draft", "standard", "fine"};
  StepLimits limits;
  limits.memory_bytes = static_cast<std::uint64_t>(jobs.memory_mib) << 20;
  limits.time = std::chrono::minutes(jobs.time_limit_min);
  limits.cpu_time = 4 * limits.time;
  return station_chain(quality.at(static_cast<std::size_t>(jobs.quality)), limits,
                       {evidence.seal == SealTime::approved, evidence.keys_folder,
                        evidence.audit_log, evidence.time_stamp_url});
}

}  // namespace

Result<std::unique_ptr<StationService>> StationService::open(const ServiceOptions& options) {
  std::unique_ptr<StationService> service(new StationService(options));
  auto store = CaseStore::open(options.config.storage.folder, service->clock_, options.version);
  if (!store) return forward(store);
  service->store_ = *std::move(store);
  service->chain_ = chain_of(options.config.jobs, options.config.evidence);
  auto outbox = Outbox::open(options.config.delivery.folder, service->clock_);
  if (!outbox) return forward(outbox);
  service->outbox_ = *std::move(outbox);
  EngineOptions engine;
  engine.chain = service->chain_;
  engine.step_command = options.step_command;
  engine.threads = options.threads;
  engine.seed = options.seed;
  service->engine_ = std::make_unique<JobEngine>(*service->store_, engine,
                                                 [raw = service.get()](JobNews news, std::int64_t) {
                                                   switch (news) {
                                                     case JobNews::begun:
                                                       return raw->tell(StationEvent::jobs_waiting);
                                                     case JobNews::case_done:
                                                       return raw->tell(StationEvent::case_done);
                                                     case JobNews::case_failed:
                                                       return raw->tell(StationEvent::case_failed);
                                                     case JobNews::all_ended:
                                                       return raw->tell(StationEvent::jobs_ended);
                                                   }
                                                 });
  return service;
}

StationService::~StationService() {
  if (station_) station_->hardware.interlock->on_trip({});
  scan_stop_.request_stop();
}

Result<void> StationService::seal(std::int64_t result_job, const std::string& approved_by) {
  const auto result = store_->job(result_job);
  if (!result) return forward(result);
  const auto jobs = store_->jobs(result->case_id);
  if (!jobs) return forward(jobs);
  const auto present = current_jobs(*jobs);
  if (result->step != result_step ||
      std::ranges::find(present, result_job, &Job::id) == present.end()) {
    return fail(ErrorKind::usage, fmt::format("job {}", result_job),
                "is not its case's present result");
  }
  const auto kind = std::ranges::find(chain_, seal_step, &StepKind::name);
  const auto sealing = store_->appoint_on_approval(
      result->case_id, *kind, nlohmann::json{{"approved_by", approved_by}}.dump());
  if (!sealing) return forward(sealing);
  engine_->wake();
  return {};
}

void StationService::tell(StationEvent event, std::optional<StationState> only_in) {
  {
    const std::lock_guard lock(mutex_);
    events_.push_back({event, only_in});
  }
  changed_.notify_all();
}

void StationService::say(std::string message) {
  log(message);
  const std::lock_guard lock(mutex_);
  status_.message = std::move(message);
}

void StationService::log(std::string words) {
  constexpr std::size_t kept = 500;
  fmt::print(stderr, "{}\n", words);
  const std::lock_guard lock(mutex_);
  log_.push_back({++logged_, to_iso8601(clock_.utc_now()), std::move(words)});
  if (log_.size() > kept) log_.pop_front();
}

std::vector<LogLine> StationService::log_after(std::uint64_t number) const {
  const std::lock_guard lock(mutex_);
  std::vector<LogLine> lines;
  std::ranges::copy_if(log_, std::back_inserter(lines),
                       [&](const LogLine& line) { return line.number > number; });
  return lines;
}

StationStatus StationService::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void StationService::set_case_number(std::string number) {
  const std::lock_guard lock(mutex_);
  next_number_ = std::move(number);
}

Station* StationService::station() const {
  const std::lock_guard lock(mutex_);
  return station_.get();
}

SimulatedStation* StationService::simulated() const {
  const Station* open = station();
  return open == nullptr || !open->room ? nullptr : &open->room->station();
}

Result<CameraPreview> StationService::preview(const std::string& camera) {
  return previews_.look(camera, station(), options_.config, cameras_mutex_, clock_);
}

std::vector<Finding> StationService::check() {
  Findings findings;
  check_machine(options_.config, store_->folder(), findings);
  const std::unique_lock lock(cameras_mutex_, std::try_to_lock);
  const Station* open = station();
  if (open == nullptr) {
    findings.warn("station", "is not open", status().message);
  } else if (!lock) {
    findings.warn("cameras", "are at work and were not looked at", "look again after the scan");
  } else {
    check_parts(options_.config, *open, findings);
  }
  return findings.list;
}

std::vector<std::string> StationService::damage_of(std::int64_t case_id) const {
  const std::lock_guard lock(mutex_);
  const auto found = damage_.find(case_id);
  return found == damage_.end() ? std::vector<std::string>{} : found->second;
}

void StationService::run(const std::stop_token& stop, const std::function<void()>& alive) {
  act(StationAction::open);
  files_ = std::jthread([this](const std::stop_token& ended) { watch_files(ended); });
  auto next_removal = clock_.now();
  while (status().state != StationState::stopped) {
    alive();
    if (clock_.now() >= next_removal) {
      remove_expired();
      next_removal = clock_.now() + 1h;
    }
    std::optional<ToldEvent> event;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, stop, 500ms, [this] { return !events_.empty(); });
      if (stop.stop_requested()) {
        event = ToldEvent{StationEvent::shut_down, std::nullopt};
      } else if (!events_.empty()) {
        event = events_.front();
        events_.pop_front();
      }
    }
    if (event) walk(*event);
  }
  if (worker_.joinable()) worker_.join();
}

void StationService::walk(const ToldEvent& told) {
  const StationState state = status().state;
  const StationEvent event = told.event;
  if (told.only_in && *told.only_in != state) return;
  const Transition* transition = find_transition(state, event);
  if (transition == nullptr) return;
  log(fmt::format("{}: {} -> {}", to_string(event), to_string(transition->from),
                  to_string(transition->to)));
  {
    const std::lock_guard lock(mutex_);
    status_.state = transition->to;
    status_.signal = transition->signal;
    if (event == StationEvent::case_done) status_.message = "A case is ready.";
    if (event == StationEvent::case_failed) {
      status_.message = "A case could not be built: see the list of cases.";
    }
  }
  if (event == StationEvent::stop_pressed || event == StationEvent::door_opened) {
    if (Station* open = station()) {
      say(fmt::format("Stopped: {}. Make the station safe, then press the button.",
                      open->hardware.interlock->reason()));
    }
  }
  if (Station* open = station()) {
    if (const auto shown = open->hardware.lamp->show(transition->signal); !shown) {
      log(shown.error().message());
    }
  }
  act(transition->action);
}

void StationService::act(StationAction action) {
  switch (action) {
    case StationAction::none: return;
    case StationAction::open: return work([this] { open_parts(false); });
    case StationAction::reset_and_open: return work([this] { open_parts(true); });
    case StationAction::begin_scan: return work([this] { scan(false); });
    case StationAction::resume_scan: return work([this] { scan(true); });
    case StationAction::confirm_placement:
    case StationAction::cancel_scan: {
      {
        const std::lock_guard lock(mutex_);
        (action == StationAction::cancel_scan ? given_up_ : confirmed_) = true;
        if (given_up_) scan_stop_.request_stop();
      }
      return changed_.notify_all();
    }
    case StationAction::look_for_jobs: {
      const auto outstanding = store_->outstanding();
      if (outstanding && !outstanding->empty()) tell(StationEvent::jobs_waiting);
      return;
    }
    case StationAction::halt_scan:
    case StationAction::stop: {
      const std::lock_guard lock(mutex_);
      scan_stop_.request_stop();
      return;
    }
  }
}

void StationService::work(std::function<void()> task) {
  worker_ = std::jthread([task = std::move(task), before = std::move(worker_)]() mutable {
    if (before.joinable()) before.join();
    task();
  });
}

void StationService::open_parts(bool reset) {
  if (station() == nullptr) {
    auto opened = open_station(options_.config, RoomSetting::specimen_on_table, options_.seed,
                               options_.threads, SimulatedTime::real_time);
    if (!opened) {
      say(opened.error().message());
      return tell(StationEvent::not_opened);
    }
    {
      const std::lock_guard lock(mutex_);
      station_ = std::make_unique<Station>(*std::move(opened));
    }
    // A simulated room needs several times as much while it is being built.
    ::malloc_trim(0);
    Interlock& interlock = *station_->hardware.interlock;
    interlock.on_trip([this, &interlock] {
      tell(interlock.reason() == door_open ? StationEvent::door_opened
                                           : StationEvent::stop_pressed);
    });
    button_ = std::jthread([this](const std::stop_token& stop) { watch_button(stop); });
    if (options_.config.camera_check_s > 0) {
      cameras_ = std::jthread([this](const std::stop_token& stop) { watch_cameras(stop); });
    }
  } else {
    const std::lock_guard lock(cameras_mutex_);
    for (StationCamera& camera : station_->cameras) {
      if (const auto back = camera.camera->reopen(); !back) {
        say(fmt::format("camera \"{}\": {}", camera.config.id, back.error().message()));
        return tell(StationEvent::not_opened);
      }
    }
  }
  Interlock& interlock = *station_->hardware.interlock;
  if (reset && interlock.tripped()) {
    if (const auto unlatched = interlock.reset(); !unlatched) {
      say(unlatched.error().message());
      return tell(StationEvent::not_opened);
    }
  }
  if (interlock.tripped() && interlock.reason() != door_open) {
    say(interlock.reason() + ": make the station safe, then press the button");
    return tell(StationEvent::not_opened);
  }
  const auto resume = scan_to_resume();
  if (!resume) {
    say(resume.error().message());
    return tell(StationEvent::not_opened);
  }
  if (!*resume) say("Lay the next specimen upright on the board, then press the button.");
  tell(*resume ? StationEvent::unfinished_scan : StationEvent::opened);
}

/// A scan that was begun and has pictures. One without any is given up: nothing is lost, and the
/// platter must not turn before somebody has pressed the button.
Result<bool> StationService::scan_to_resume() {
  const auto unfinished = store_->unfinished_scan();
  if (!unfinished) return forward(unfinished);
  if (!*unfinished) return false;
  const auto folder = store_->scan_folder((*unfinished)->id);
  if (std::filesystem::exists(folder / "session.json")) {
    const auto session = read_session(folder);
    if (!session) return forward(session);
    if (!session->views.empty()) return true;
  }
  if (auto given_up = store_->give_up_scan((*unfinished)->id); !given_up) return forward(given_up);
  return false;
}

/// The case that is about to be scanned; nothing if the scan can't begin yet (the message says
/// why).
Result<std::optional<Case>> StationService::begin_case() {
  Interlock& interlock = *station_->hardware.interlock;
  if (interlock.tripped()) {
    // The door had to be opened to lay the specimen down.
    if (const auto closed = interlock.reset(); !closed) {
      say(closed.error().message());
      return std::nullopt;
    }
  }
  std::uint64_t needed = scan_space_bytes(options_.config) * 13 / 10;
  std::uint64_t largest_step = 0;
  for (const StepKind& kind : chain_) largest_step = std::max(largest_step, kind.space_bytes);
  needed += largest_step;
  const auto free = free_space_bytes(store_->folder());
  if (!free) return forward(free);
  if (*free < needed) {
    say(fmt::format("{}: a scan and its models may need {} MiB, {} are free; free some space",
                    store_->folder().string(), needed >> 20, *free >> 20));
    return std::nullopt;
  }
  std::string number;
  {
    const std::lock_guard lock(mutex_);
    number = std::exchange(next_number_, {});
  }
  if (number.empty()) {
    const auto known = store_->cases();
    if (!known) return forward(known);
    number = fmt::format("{:%Y-%m-%d}-{:04}",
                         fmt::gmtime(std::chrono::system_clock::to_time_t(clock_.utc_now())),
                         known->size() + 1);
  }
  auto begun = store_->begin_scan(number);
  if (!begun) return forward(begun);
  return *std::move(begun);
}

void StationService::scan(bool resume) {
  const std::lock_guard cameras_lock(cameras_mutex_);
  auto owner = resume ? store_->unfinished_scan() : begin_case();
  if (!owner) {
    say(owner.error().message());
    return tell(StationEvent::scan_refused);
  }
  if (!*owner) return tell(StationEvent::scan_refused);
  const Case scanned = **owner;
  std::stop_source stop;
  {
    const std::lock_guard lock(mutex_);
    // Who has shut the station down meanwhile did not know of this scan.
    if (status_.state == StationState::stopped) stop.request_stop();
    scan_stop_ = stop;
    given_up_ = false;
    status_.scanning = scanned.id;
    status_.scan_fraction = 0.0;
    status_.message = fmt::format("Case {} is being photographed: hands off.", scanned.number);
  }
  Progress progress;
  progress.stop = stop.get_token();
  progress.report = [this](double fraction, std::string_view stage) {
    const std::lock_guard lock(mutex_);
    status_.scan_fraction = fraction;
    status_.scan_stage = stage;
  };
  const auto report = photograph_specimen(
      options_.config, *station_, scanned.number, store_->scan_folder(scanned.id),
      [this](const PlacementRequest& request, const std::stop_token& asked_to_stop) {
        return ask_for_placement(request, asked_to_stop);
      },
      progress);
  bool given_up = false;
  {
    const std::lock_guard lock(mutex_);
    given_up = given_up_;
    status_.scanning.reset();
  }
  Result<void> kept;
  if (report) {
    kept = store_->save_scan(scanned.id, chain_);
    if (kept) {
      engine_->wake();
      say(fmt::format("Case {} is saved. The next specimen may come.", scanned.number));
      return tell(StationEvent::scan_saved);
    }
  } else if (given_up) {
    kept = store_->give_up_scan(scanned.id);
    if (kept) {
      say(fmt::format("The scan of case {} was given up.", scanned.number));
      return tell(StationEvent::scan_cancelled);
    }
  }
  say((report ? kept.error() : report.error()).message());
  tell(StationEvent::scan_failed);
}

Result<void> StationService::ask_for_placement(const PlacementRequest& request,
                                               const std::stop_token& stop) {
  {
    const std::lock_guard lock(mutex_);
    confirmed_ = false;
  }
  say(placement_prompt(request));
  tell(StationEvent::placement_wanted);
  std::unique_lock lock(mutex_);
  if (changed_.wait(lock, stop, [this] { return confirmed_; })) return {};
  return fail(ErrorKind::cancelled, "scan", "stopped on request");
}

}  // namespace skullstation
