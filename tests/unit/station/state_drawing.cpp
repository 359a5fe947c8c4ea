#include "tests/unit/station/state_drawing.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "daemon/station/state_table.h"

namespace skullstation::testing {

namespace {

/// Mermaid's names have no hyphens.
std::string identifier(StationState state) {
  std::string name(to_string(state));
  std::ranges::replace(name, '-', '_');
  return name;
}

}  // namespace

std::string state_diagram() {
  std::string text = "stateDiagram-v2\n  [*] --> starting\n";
  for (const StationState state : station_states()) {
    text += fmt::format("  state \"{}\" as {}\n", to_string(state), identifier(state));
  }
  // Events that lead the same way share an arrow; shut down leads to stopped from everywhere.
  std::vector<std::pair<StationState, StationState>> order;
  std::map<std::pair<StationState, StationState>, std::string> labels;
  for (const Transition& t : station_transitions()) {
    if (t.event == StationEvent::shut_down) continue;
    const std::pair arrow{t.from, t.to};
    if (std::ranges::find(order, arrow) == order.end()) order.push_back(arrow);
    std::string& label = labels[arrow];
    if (!label.empty()) label += "<br>";
    label += to_string(t.event);
  }
  for (const auto& arrow : order) {
    text += fmt::format("  {} --> {}: {}\n", identifier(arrow.first), identifier(arrow.second),
                        labels[arrow]);
  }
  return text + "  stopped --> [*]\n";
}

std::string state_matrix() {
  std::string text = "| in | at | then | lamp and buzzer | action |\n|---|---|---|---|---|\n";
  for (const Transition& t : station_transitions()) {
    text += fmt::format("| {} | {} | {} | {} | {} |\n", to_string(t.from), to_string(t.event),
                        to_string(t.to), to_string(t.signal), to_string(t.action));
  }
  return text;
}

}  // namespace skullstation::testing
