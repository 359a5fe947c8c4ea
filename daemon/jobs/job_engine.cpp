#include "daemon/jobs/job_engine.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/file.h"
#include "core/median.h"
#include "daemon/jobs/step_process.h"

namespace skullstation {

namespace fs = std::filesystem;
using std::chrono::steady_clock;

namespace {

constexpr std::size_t longest_log = std::size_t{16} * 1024;
constexpr std::size_t longest_figures = std::size_t{1024} * 1024;
constexpr int past_runs = 20;

/// The end of a file; empty if there is none.
std::string tail_of(const fs::path& file, std::size_t most) {
  std::ifstream in(file, std::ios::binary | std::ios::ate);
  if (!in) return {};
  const auto size = static_cast<std::size_t>(in.tellg());
  const std::size_t count = std::min(size, most);
  std::string text(count, '\0');
  in.seekg(static_cast<std::streamoff>(size - count));
  in.read(text.data(), static_cast<std::streamsize>(count));
  // Whatever a step prints, the database and the console hold valid UTF-8.
  return nlohmann::json::parse(
             nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace))
      .get<std::string>();
}

std::string last_line(const std::string& text) {
  const auto end = text.find_last_not_of("\n\r ");
  if (end == std::string::npos) return {};
  const auto begin = text.find_last_of("\n\r", end);
  return text.substr(begin == std::string::npos ? 0 : begin + 1,
                     end - (begin == std::string::npos ? 0 : begin + 1) + 1);
}

/// What the step reported: one JSON object, else nothing.
std::string figures_of(const fs::path& file) {
  std::error_code error;
  if (fs::file_size(file, error) > longest_figures || error) return {};
  const auto text = read_file(file);
  if (!text || !nlohmann::json::accept(*text)) return {};
  return *text;
}

/// Files and folders only, and all that was promised.
std::string flaw_of_artifact(const fs::path& folder, const StepKind& kind) {
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const auto status = entry->symlink_status(error);
    if (!fs::is_directory(status) && !fs::is_regular_file(status)) {
      return fmt::format("left something that is not a file: {}",
                         entry->path().lexically_relative(folder).string());
    }
  }
  for (const std::string& promise : kind.promises) {
    if (!fs::is_regular_file(folder / promise, error)) {
      return fmt::format("ended as if all were well, yet left no {}", promise);
    }
  }
  return {};
}

}  // namespace

JobEngine::JobEngine(CaseStore& store, EngineOptions options, Tell tell)
    : store_(store),
      options_(std::move(options)),
      tell_(std::move(tell)),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

JobEngine::~JobEngine() = default;

void JobEngine::wake() {
  {
    const std::lock_guard lock(mutex_);
    woken_ = true;
  }
  changed_.notify_all();
}

void JobEngine::set_trouble(std::string words) {
  const std::lock_guard lock(mutex_);
  trouble_ = std::move(words);
}

std::string JobEngine::trouble() const {
  const std::lock_guard lock(mutex_);
  return trouble_;
}

void JobEngine::pause(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, stop, options_.retry_pause, [this] { return woken_; });
  woken_ = false;
}

const StepKind* JobEngine::kind_of(const std::string& step) const {
  const auto found = std::ranges::find(options_.chain, step, &StepKind::name);
  return found == options_.chain.end() ? nullptr : &*found;
}

void JobEngine::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto job = store_.next_job();
    if (!job) {
      set_trouble(job.error().message());
      pause(stop);
      continue;
    }
    if (!*job) {
      set_trouble({});
      std::unique_lock lock(mutex_);
      changed_.wait(lock, stop, [this] { return woken_; });
      woken_ = false;
      continue;
    }
    auto begun = check_space(**job);
    if (begun) begun = store_.start((*job)->id);
    if (!begun) {
      set_trouble(begun.error().message());
      pause(stop);
      continue;
    }
    set_trouble({});
    make(**job, stop);
  }
}

Result<void> JobEngine::check_space(const Job& job) const {
  const StepKind* kind = kind_of(job.step);
  const auto free = free_space_bytes(store_.folder());
  if (!free) return forward(free);
  if (kind == nullptr || *free >= kind->space_bytes) return {};
  constexpr std::uint64_t mib = std::uint64_t{1024} * 1024;
  return fail(ErrorKind::bad_input, store_.folder().string(),
              fmt::format("the step {} of case {} waits: it may need {} MiB, {} are free", job.step,
                          job.case_id, kind->space_bytes / mib, *free / mib),
              "free some space on this volume");
}

/// Another one at each try: a process that outlived its daemon may still write to the last.
fs::path JobEngine::work_folder(const Job& job) const {
  for (int attempt = 1;; ++attempt) {
    fs::path folder =
        store_.folder() / "work" / fmt::format("{}-{}-{}", job.id, ::getpid(), attempt);
    if (!fs::exists(folder)) return folder;
  }
}

Result<void> JobEngine::prepare(const Job& job, const StepKind& kind,
                                const fs::path& folder) const {
  if (auto made = make_writable_folder(folder); !made) return made;
  nlohmann::ordered_json inputs = nlohmann::ordered_json::object();
  for (const auto& [name, from] : job.inputs) {
    const fs::path place = folder / "in" / name;
    if (auto laid = store_.lay_out(from, place); !laid) return laid;
    inputs[name] = place.string();
  }
  const nlohmann::ordered_json request = {
      {"format", "skullstation-step/1"},
      {"step", job.step},
      {"inputs", inputs},
      {"options", nlohmann::json::parse(job.options, nullptr, false)},
      {"station", nlohmann::json::parse(kind.station, nullptr, false)},
      {"out", (folder / "out").string()},
      {"threads", options_.threads},
      {"seed", options_.seed}};
  return write_file_durably(folder / "request.json", request.dump(2) + "\n");
}

StepOutcome JobEngine::execute(const Job& job, const fs::path& folder,
                               const std::stop_token& stop) {
  const auto failed = [](std::string words) {
    StepOutcome outcome;
    outcome.state = JobState::failed;
    outcome.error = std::move(words);
    return outcome;
  };
  const StepKind* kind = kind_of(job.step);
  if (kind == nullptr) return failed("this version of the program has no such step");
  if (auto prepared = prepare(job, *kind, folder); !prepared)
    return failed(prepared.error().message());

  StepProcess process;
  process.command = options_.step_command;
  process.command.insert(process.command.end(), {job.step, folder.string()});
  process.folder = folder;
  process.log = folder / "log.txt";
  process.limits = kind->limits;
  process.lock = store_.folder() / "step.lock";
  process.grace = options_.grace;
  process.on_line = [this](std::string_view line) {
    const auto json = nlohmann::json::parse(line, nullptr, false);
    if (!json.is_object() || !json.contains("fraction") || !json["fraction"].is_number()) return;
    const std::lock_guard lock(mutex_);
    if (!progress_) return;
    progress_->fraction = std::clamp(json["fraction"].get<double>(), 0.0, 1.0);
    if (json.contains("stage") && json["stage"].is_string()) progress_->stage = json["stage"];
  };
  const auto end = run_step_process(process, stop);
  if (!end) {
    auto outcome = failed(end.error().message());
    if (end.error().kind == ErrorKind::cancelled) outcome.state = JobState::cancelled;
    return outcome;
  }
  StepOutcome outcome{JobState::done, end->seconds, end->cpu_seconds, end->peak_mib, {}, {}, {}};
  outcome.log = tail_of(process.log, longest_log);
  if (end->how == StepEnd::How::stopped) {
    outcome.state = JobState::cancelled;
    return outcome;
  }
  outcome.error = end_in_words(*end, kind->limits);
  if (outcome.error.empty()) {
    outcome.error = flaw_of_artifact(folder / "out", *kind);
  } else if (const std::string words = last_line(outcome.log); !words.empty()) {
    outcome.error += "; its last words: " + words;
  }
  if (!outcome.error.empty()) outcome.state = JobState::failed;
  outcome.figures = figures_of(folder / "result.json");
  return outcome;
}

void JobEngine::make(const Job& job, const std::stop_token& stop) {
  std::stop_source step_stop;
  {
    const std::lock_guard lock(mutex_);
    step_stop_ = step_stop;
    cancelled_ = false;
    begun_ = steady_clock::now();
    progress_ = StepProgress{job.id, job.case_id, job.step, 0.0, "", 0.0};
  }
  tell_(JobNews::begun, job.case_id);
  const fs::path folder = work_folder(job);
  StepOutcome outcome;
  {
    const std::stop_callback ends(stop, [&step_stop] { step_stop.request_stop(); });
    outcome = execute(job, folder, step_stop.get_token());
  }
  bool by_a_person = false;
  {
    const std::lock_guard lock(mutex_);
    by_a_person = cancelled_;
    progress_.reset();
  }
  if (outcome.state == JobState::cancelled && !by_a_person) {
    // The station goes down. Where this fails, the next start finds the job interrupted.
    static_cast<void>(store_.put_back(job.id));
    std::error_code ignored;
    fs::remove_all(folder, ignored);
    return;
  }
  // What was made is kept until it is safe: a full disk must not cost an hour's work.
  while (!stop.stop_requested()) {
    const auto finished = store_.finish(job.id, outcome, folder / "out");
    if (finished) {
      set_trouble({});
      std::error_code ignored;
      fs::remove_all(folder, ignored);
      return tell_outcome(job, outcome.state);
    }
    set_trouble(finished.error().message());
    pause(stop);
  }
}

void JobEngine::tell_outcome(const Job& job, JobState state) {
  if (state == JobState::failed) tell_(JobNews::case_failed, job.case_id);
  if (state == JobState::done) {
    const auto owner = store_.case_of(job.case_id);
    const StepKind* kind = kind_of(job.step);
    const bool asked_for = kind != nullptr && kind->on_approval;  // the result was told before
    if (owner && owner->state == CaseState::done && !asked_for) {
      tell_(JobNews::case_done, job.case_id);
    }
  }
  const auto left = store_.outstanding();
  if (left && left->empty()) tell_(JobNews::all_ended, job.case_id);
}

Result<void> JobEngine::cancel(std::int64_t job) {
  {
    const std::lock_guard lock(mutex_);
    if (progress_ && progress_->job == job) {
      cancelled_ = true;
      step_stop_.request_stop();
      return {};
    }
  }
  return store_.cancel_waiting(job);
}

std::optional<StepProgress> JobEngine::progress() const {
  const std::lock_guard lock(mutex_);
  auto shown = progress_;
  if (shown) {
    shown->seconds = std::chrono::duration<double>(steady_clock::now() - begun_).count();
  }
  return shown;
}

Result<std::optional<std::chrono::seconds>> JobEngine::time_left(std::int64_t case_id) const {
  const auto queue = store_.outstanding();
  if (!queue) return forward(queue);
  const auto running = progress();
  double seconds = 0.0;
  double until_done = 0.0;
  for (const Job& job : *queue) {
    const auto past = store_.past_seconds(job.step, job.options, past_runs);
    if (!past) return forward(past);
    if (past->empty()) return std::nullopt;
    double left = median(*past);
    if (running && running->job == job.id) {
      const double own = running->fraction > 0.05
                             ? running->seconds * (1.0 - running->fraction) / running->fraction
                             : 0.0;
      left = left > running->seconds ? left - running->seconds : own;
    }
    seconds += left;
    if (job.case_id == case_id) until_done = seconds;
  }
  return std::chrono::seconds(static_cast<std::int64_t>(std::ceil(until_done)));
}

}  // namespace skullstation
