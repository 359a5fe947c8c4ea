#include "daemon/station/state_table.h"

#include <algorithm>
#include <array>

namespace skullstation {

namespace {

using enum StationState;
using enum StationEvent;
using enum StationAction;

// clang-format off
constexpr auto transitions = std::to_array<Transition>({
    // from      event             to         lamp and buzzer    action
    {starting,  opened,           ready,     Signal::ready,     look_for_jobs},
    {starting,  unfinished_scan,  scanning,  Signal::working,   resume_scan},
    {starting,  not_opened,       fault,     Signal::fault,     none},
    {starting,  stop_pressed,     fault,     Signal::fault,     none},

    {ready,     go,               scanning,  Signal::working,   begin_scan},
    {ready,     jobs_waiting,     building,  Signal::building,  none},
    {ready,     case_done,        result,    Signal::done,      none},
    {ready,     case_failed,      result,    Signal::attention, none},
    {ready,     stop_pressed,     fault,     Signal::fault,     none},
    {ready,     camera_lost,      fault,     Signal::fault,     none},

    {scanning,  placement_wanted, turn_over, Signal::attention, none},
    {scanning,  scan_saved,       building,  Signal::building,  none},
    {scanning,  cancel,           scanning,  Signal::working,   cancel_scan},
    {scanning,  scan_cancelled,   ready,     Signal::ready,     look_for_jobs},
    {scanning,  scan_refused,     ready,     Signal::attention, none},
    {scanning,  scan_failed,      fault,     Signal::fault,     none},
    {scanning,  stop_pressed,     fault,     Signal::fault,     halt_scan},
    {scanning,  door_opened,      fault,     Signal::fault,     halt_scan},

    {turn_over, go,               scanning,  Signal::working,   confirm_placement},
    {turn_over, cancel,           scanning,  Signal::working,   cancel_scan},
    {turn_over, scan_failed,      fault,     Signal::fault,     none},
    {turn_over, stop_pressed,     fault,     Signal::fault,     halt_scan},

    {building,  go,               scanning,  Signal::working,   begin_scan},
    {building,  case_done,        result,    Signal::done,      none},
    {building,  case_failed,      result,    Signal::attention, none},
    {building,  jobs_ended,       ready,     Signal::ready,     none},
    {building,  stop_pressed,     fault,     Signal::fault,     none},
    {building,  camera_lost,      fault,     Signal::fault,     none},

    {result,    go,               scanning,  Signal::working,   begin_scan},
    {result,    cancel,           ready,     Signal::ready,     look_for_jobs},
    {result,    case_done,        result,    Signal::done,      none},
    {result,    case_failed,      result,    Signal::attention, none},
    {result,    stop_pressed,     fault,     Signal::fault,     none},
    {result,    camera_lost,      fault,     Signal::fault,     none},

    {fault,     go,               starting,  Signal::working,   reset_and_open},
    {fault,     camera_back,      starting,  Signal::working,   open},

    {starting,  shut_down,        stopped,   Signal::off,       stop},
    {ready,     shut_down,        stopped,   Signal::off,       stop},
    {scanning,  shut_down,        stopped,   Signal::off,       stop},
    {turn_over, shut_down,        stopped,   Signal::off,       stop},
    {building,  shut_down,        stopped,   Signal::off,       stop},
    {result,    shut_down,        stopped,   Signal::off,       stop},
    {fault,     shut_down,        stopped,   Signal::off,       stop},
});
// clang-format on

constexpr std::array state_names{"starting", "ready",  "scanning", "turn-over",
                                 "building", "result", "fault",    "stopped"};
constexpr std::array event_names{
    "opened",           "unfinished scan", "not opened",     "go",           "cancel",
    "placement wanted", "scan saved",      "scan cancelled", "scan refused", "scan failed",
    "stop pressed",     "door opened",     "camera lost",    "camera back",  "jobs waiting",
    "case done",        "case failed",     "jobs ended",     "shut down"};
constexpr std::array action_names{"",
                                  "open",
                                  "reset and open",
                                  "begin scan",
                                  "resume scan",
                                  "confirm placement",
                                  "cancel scan",
                                  "halt scan",
                                  "look for jobs",
                                  "stop"};
constexpr std::array signal_names{"off",      "ready", "working", "attention",
                                  "building", "done",  "fault"};
static_assert(state_names.size() == static_cast<std::size_t>(stopped) + 1);
static_assert(event_names.size() == static_cast<std::size_t>(shut_down) + 1);
static_assert(action_names.size() == static_cast<std::size_t>(stop) + 1);
static_assert(signal_names.size() == static_cast<std::size_t>(Signal::fault) + 1);

template <class Enum, std::size_t count>
constexpr std::array<Enum, count> all_of() {
  std::array<Enum, count> all{};
  for (std::size_t i = 0; i < count; ++i) all[i] = static_cast<Enum>(i);
  return all;
}

constexpr auto states = all_of<StationState, state_names.size()>();
constexpr auto events = all_of<StationEvent, event_names.size()>();

}  // namespace

std::span<const Transition> station_transitions() { return transitions; }

const Transition* find_transition(StationState state, StationEvent event) {
  const auto found = std::ranges::find_if(
      transitions, [&](const Transition& t) { return t.from == state && t.event == event; });
  return found == transitions.end() ? nullptr : &*found;
}

std::span<const StationState> station_states() { return states; }
std::span<const StationEvent> station_events() { return events; }

std::string_view to_string(StationState state) {
  return state_names[static_cast<std::size_t>(state)];
}
std::string_view to_string(StationEvent event) {
  return event_names[static_cast<std::size_t>(event)];
}
std::string_view to_string(StationAction action) {
  return action_names[static_cast<std::size_t>(action)];
}
std::string_view to_string(Signal signal) { return signal_names[static_cast<std::size_t>(signal)]; }

}  // namespace skullstation
