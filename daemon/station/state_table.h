#pragma once

#include <span>
#include <string_view>

#include "firmware_io/panel.h"

namespace skullstation {

// What the scanner's front does, as data: docs/station.md is drawn from this table, and the service
// (daemon/service) does nothing but look events up in it and carry out the action it finds.

enum class StationState {
  starting,   ///< opening hardware and cameras
  ready,      ///< press to scan
  scanning,   ///< hands off
  turn_over,  ///< waits for the specimen to be laid down as the screen says
  building,   ///< ready for the next specimen; earlier cases are still being built
  result,     ///< ready for the next specimen; a case has ended since the button was last pressed
  fault,      ///< latched: someone has to make the station safe, then press
  stopped,    ///< the end
};

enum class StationEvent {
  // from opening the station
  opened,
  unfinished_scan,  ///< opened, and an earlier scan was interrupted
  not_opened,
  // from a person: the button, or the same buttons of the console
  go,      ///< brief press: start, confirm, reset
  cancel,  ///< held press
  // from the scan
  placement_wanted,
  scan_saved,  ///< every picture and the case's row are on the disk
  scan_cancelled,
  scan_refused,  ///< not begun: the door is open, no space
  scan_failed,
  // from interlock and cameras
  stop_pressed,
  door_opened,
  camera_lost,
  camera_back,
  // from the jobs
  jobs_waiting,
  case_done,
  case_failed,
  jobs_ended,  ///< nothing is waiting or running any more
  // from systemd or the console
  shut_down,
};

enum class StationAction {
  none,
  open,            ///< hardware and cameras, as far as they are not open
  reset_and_open,  ///< first unlatch the interlock
  begin_scan,
  resume_scan,
  confirm_placement,
  cancel_scan,    ///< for good
  halt_scan,      ///< it can go on later
  look_for_jobs,  ///< tells jobs_waiting if there are any
  stop,           ///< scan and steps end where they can be resumed
};

struct Transition {
  StationState from;
  StationEvent event;
  StationState to;
  Signal signal;  ///< lamp and buzzer from now on
  StationAction action;
};

/// Every transition. A pair of state and event that is not listed changes nothing.
std::span<const Transition> station_transitions();

/// The transition of the pair, or null: the event means nothing in this state.
const Transition* find_transition(StationState state, StationEvent event);

std::span<const StationState> station_states();
std::span<const StationEvent> station_events();

/// "turn-over", "scan saved", "begin scan": as documents and the console call them.
std::string_view to_string(StationState state);
std::string_view to_string(StationEvent event);
std::string_view to_string(StationAction action);
std::string_view to_string(Signal signal);

}  // namespace skullstation
