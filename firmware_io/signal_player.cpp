#include "firmware_io/signal_player.h"

#include <algorithm>
#include <array>
#include <utility>

namespace skullstation {

using namespace std::chrono_literals;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

namespace {

enum class Lamp { none, green, yellow, green_and_yellow, red };

struct Pattern {
  Signal signal;
  Lamp lamp;
  bool blinking;
  int beeps;
  milliseconds beep;  // the length of each
};

constexpr std::array<Pattern, 7> patterns{{
    {Signal::off, Lamp::none, false, 0, 0ms},
    {Signal::ready, Lamp::green, false, 0, 0ms},
    {Signal::working, Lamp::yellow, false, 0, 0ms},
    {Signal::attention, Lamp::yellow, true, 2, 200ms},
    {Signal::building, Lamp::green_and_yellow, false, 1, 200ms},
    {Signal::done, Lamp::green, true, 1, 1000ms},
    {Signal::fault, Lamp::red, false, 3, 400ms},
}};
constexpr milliseconds blink_half = 500ms;
constexpr milliseconds pause_between_beeps = 200ms;

constexpr bool in_order() {
  for (std::size_t i = 0; i < patterns.size(); ++i) {
    if (static_cast<std::size_t>(patterns[i].signal) != i) return false;
  }
  return true;
}
static_assert(in_order());

const Pattern& pattern_of(Signal signal) { return patterns[static_cast<std::size_t>(signal)]; }

milliseconds beep_period(const Pattern& pattern) { return pattern.beep + pause_between_beeps; }

bool still_beeping(const Pattern& pattern, milliseconds shown_for) {
  return shown_for < pattern.beeps * beep_period(pattern);
}

}  // namespace

PanelState panel_at(Signal signal, milliseconds shown_for) {
  const Pattern& pattern = pattern_of(signal);
  const bool lit = !pattern.blinking || shown_for / blink_half % 2 == 0;
  const bool beeping =
      still_beeping(pattern, shown_for) && shown_for % beep_period(pattern) < pattern.beep;
  const bool both = pattern.lamp == Lamp::green_and_yellow;
  return {.green = lit && (both || pattern.lamp == Lamp::green),
          .yellow = lit && (both || pattern.lamp == Lamp::yellow),
          .red = lit && pattern.lamp == Lamp::red,
          .buzzer = beeping};
}

std::optional<milliseconds> next_change(Signal signal, milliseconds shown_for) {
  const Pattern& pattern = pattern_of(signal);
  std::optional<milliseconds> next;
  if (pattern.blinking) next = (shown_for / blink_half + 1) * blink_half;
  if (still_beeping(pattern, shown_for)) {
    const milliseconds period = beep_period(pattern);
    const milliseconds begin = shown_for / period * period;
    const milliseconds end = begin + pattern.beep;
    const milliseconds edge = shown_for < end ? end : begin + period;
    next = next ? std::min(*next, edge) : edge;
  }
  return next;
}

SignalPlayer::SignalPlayer(std::function<Result<void>(PanelState)> apply)
    : apply_(std::move(apply)), player_([this](const std::stop_token& stop) { play(stop); }) {}

SignalPlayer::~SignalPlayer() {
  player_.request_stop();
  player_.join();
  static_cast<void>(apply_({}));  // nobody is left to hear of a failure
}

Result<void> SignalPlayer::show(Signal signal) {
  const std::lock_guard lock(mutex_);
  signal_ = signal;
  shown_at_ = steady_clock::now();
  const Result<void> before = std::exchange(last_, {});
  const Result<void> now = apply_(panel_at(signal, 0ms));
  changed_.notify_all();
  return now ? before : now;
}

void SignalPlayer::play(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  auto playing = shown_at_;
  milliseconds applied{0};  // how far into the signal the lines are
  while (!stop.stop_requested()) {
    if (playing != shown_at_) {
      playing = shown_at_;
      applied = 0ms;
    }
    const auto shown_anew = [&] { return shown_at_ != playing; };
    const auto change = next_change(signal_, applied);
    if (!change) {
      changed_.wait(lock, stop, shown_anew);
    } else if (!changed_.wait_until(lock, stop, playing + *change, shown_anew) &&
               !stop.stop_requested()) {
      applied = std::chrono::floor<milliseconds>(steady_clock::now() - playing);
      if (auto set = apply_(panel_at(signal_, applied)); !set) last_ = set;
    }
  }
}

}  // namespace skullstation
