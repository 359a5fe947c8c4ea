#pragma once

#include <span>
#include <string_view>

namespace skullstation {

// The way of a delivery as data: the outbox does nothing but look events up here.

enum class DeliveryState {
  queued,     ///< to be sent as soon as its target may be sent to
  sending,    ///< by the process that holds the outbox's lock
  waiting,    ///< did not work for now: tried again by itself, later and later
  rejected,   ///< will not work before a person has mended something: retry
  held,       ///< by a person: retry lets it go on
  delivered,  ///< read back and found equal
};

enum class DeliveryEvent {
  begin,        ///< somebody sends it now
  verified,     ///< everything was read back and is equal
  failed,       ///< for now: no connection, no space, busy
  refused,      ///< for good: no access, other bytes there
  interrupted,  ///< the sender was ended
  hold,
  retry,
};

struct DeliveryTransition {
  DeliveryState from;
  DeliveryEvent event;
  DeliveryState to;
};

/// Every transition: what is not listed is not allowed. None leads out of delivered, and none to
/// nowhere: nothing is ever dropped.
std::span<const DeliveryTransition> delivery_transitions();

/// The transition of the pair, or null.
const DeliveryTransition* find_transition(DeliveryState state, DeliveryEvent event);

std::span<const DeliveryState> delivery_states();

/// "queued", "sending", …
std::string_view to_string(DeliveryState state);
std::string_view to_string(DeliveryEvent event);

}  // namespace skullstation
