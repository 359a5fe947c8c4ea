#include "daemon/delivery/delivery_state.h"

#include <algorithm>
#include <array>

namespace skullstation {

namespace {

using enum DeliveryState;
using enum DeliveryEvent;

// clang-format off
constexpr auto transitions = std::to_array<DeliveryTransition>({
    {queued,   begin,       sending},
    {queued,   hold,        held},
    {waiting,  begin,       sending},
    {waiting,  hold,        held},
    {waiting,  retry,       queued},
    {sending,  verified,    delivered},
    {sending,  failed,      waiting},
    {sending,  refused,     rejected},
    {sending,  interrupted, queued},
    {rejected, hold,        held},
    {rejected, retry,       queued},
    {held,     retry,       queued},
});
// clang-format on

constexpr std::array states{queued, sending, waiting, rejected, held, delivered};
constexpr std::array state_names{"queued", "sending", "waiting", "rejected", "held", "delivered"};
constexpr std::array event_names{"begin",       "verified", "failed", "refused",
                                 "interrupted", "hold",     "retry"};
static_assert(state_names.size() == static_cast<std::size_t>(delivered) + 1);
static_assert(event_names.size() == static_cast<std::size_t>(retry) + 1);

}  // namespace

std::span<const DeliveryTransition> delivery_transitions() { return transitions; }

const DeliveryTransition* find_transition(DeliveryState state, DeliveryEvent event) {
  const auto found = std::ranges::find_if(transitions, [&](const DeliveryTransition& t) {
    return t.from == state && t.event == event;
  });
  return found == transitions.end() ? nullptr : &*found;
}

std::span<const DeliveryState> delivery_states() { return states; }

std::string_view to_string(DeliveryState state) {
  return state_names[static_cast<std::size_t>(state)];
}
std::string_view to_string(DeliveryEvent event) {
  return event_names[static_cast<std::size_t>(event)];
}

}  // namespace skullstation
