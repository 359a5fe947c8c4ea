#include "daemon/station/state_table.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <set>

#include "core/file.h"
#include "tests/unit/station/state_drawing.h"

namespace skullstation {
namespace {

using enum StationState;
using enum StationEvent;

struct Pair {
  StationState state;
  StationEvent event;
};

std::vector<Pair> all_pairs() {
  std::vector<Pair> pairs;
  for (const StationState state : station_states()) {
    for (const StationEvent event : station_events()) pairs.push_back({state, event});
  }
  return pairs;
}

std::string words(const Pair& pair) {
  return fmt::format("{}, {}", to_string(pair.state), to_string(pair.event));
}

/// Where a pair leads; an event that means nothing leaves the state.
StationState after(StationState state, StationEvent event) {
  const Transition* t = find_transition(state, event);
  return t == nullptr ? state : t->to;
}

bool can_scan(StationState state) { return state == ready || state == building || state == result; }

TEST(StateTable, EachPairIsListedAtMostOnceAndTheRestIsMeantToDoNothing) {
  std::size_t listed = 0;
  for (const Pair& pair : all_pairs()) {
    const auto count = std::ranges::count_if(station_transitions(), [&](const Transition& t) {
      return t.from == pair.state && t.event == pair.event;
    });
    EXPECT_LE(count, 1) << words(pair);
    listed += static_cast<std::size_t>(count);
  }
  EXPECT_EQ(listed, station_transitions().size());
  EXPECT_EQ(all_pairs().size(), 8U * 19U);
}

// What must hold for every state and event, whatever the table says in detail.
TEST(StateTable, EveryPairKeepsTheStationsPromises) {
  for (const Pair& pair : all_pairs()) {
    const StationState next = after(pair.state, pair.event);
    const Transition* t = find_transition(pair.state, pair.event);
    if (pair.state == stopped) {
      EXPECT_EQ(t, nullptr) << words(pair) << ": stopped is the end";
      continue;
    }
    if (pair.event == shut_down) {
      EXPECT_EQ(next, stopped) << words(pair);
    } else {
      EXPECT_NE(next, stopped) << words(pair);
    }
    if (pair.event == stop_pressed) {
      EXPECT_EQ(next, fault) << words(pair);
    }
    if (pair.state == fault && pair.event != shut_down) {
      EXPECT_EQ(next, pair.event == go || pair.event == camera_back ? starting : fault)
          << words(pair) << ": a fault is latched";
    }
    if (pair.event == go && can_scan(pair.state)) {
      EXPECT_EQ(next, scanning) << words(pair) << ": jobs never keep the next specimen waiting";
    }
    if (pair.event == cancel && (pair.state == scanning || pair.state == turn_over)) {
      ASSERT_NE(t, nullptr);
      EXPECT_EQ(t->action, StationAction::cancel_scan) << words(pair);
    }
    if (next == fault && (pair.state == scanning || pair.state == turn_over) &&
        pair.event != scan_failed && pair.state != fault) {
      ASSERT_NE(t, nullptr);
      EXPECT_EQ(t->action, StationAction::halt_scan) << words(pair) << ": nobody goes on waiting";
    }
    const bool from_jobs = pair.event == jobs_waiting || pair.event == case_done ||
                           pair.event == case_failed || pair.event == jobs_ended;
    if (from_jobs && !can_scan(pair.state)) {
      EXPECT_EQ(t, nullptr) << words(pair) << ": a job must not disturb who stands at the table";
    }
    if (t == nullptr) continue;
    EXPECT_EQ(t->signal == Signal::fault, next == fault) << words(pair);
    EXPECT_EQ(t->signal == Signal::off, next == stopped) << words(pair);
    if (next == scanning) {
      EXPECT_EQ(t->signal, Signal::working) << words(pair);
    }
    if (next == turn_over) {
      EXPECT_EQ(t->signal, Signal::attention) << words(pair);
    }
    if (next == building) {
      EXPECT_EQ(t->signal, Signal::building) << words(pair);
    }
    const bool begins = t->action == StationAction::begin_scan;
    EXPECT_EQ(begins, can_scan(pair.state) && pair.event == go) << words(pair);
  }
}

TEST(StateTable, EveryStateIsReachedAndReadyIsReachedFromAllButTheEnd) {
  const auto reached_from = [](StationState start) {
    std::set<StationState> reached{start};
    for (bool grown = true; grown;) {
      grown = false;
      for (const Transition& t : station_transitions()) {
        if (reached.contains(t.from)) grown = reached.insert(t.to).second || grown;
      }
    }
    return reached;
  };
  EXPECT_EQ(reached_from(starting).size(), station_states().size());
  for (const StationState state : station_states()) {
    if (state != stopped) {
      EXPECT_TRUE(reached_from(state).contains(ready)) << to_string(state);
    }
  }
}

TEST(StateTable, ACaseFromButtonToResult) {
  StationState state = starting;
  for (const auto& [event, expected] : std::vector<std::pair<StationEvent, StationState>>{
           {opened, ready},
           {go, scanning},
           {placement_wanted, turn_over},
           {go, scanning},
           {scan_saved, building},
           {go, scanning},         // the next specimen
           {case_done, scanning},  // the first case ends meanwhile
           {cancel, scanning},
           {scan_cancelled, ready},
           {jobs_waiting, building},
           {case_done, result},
           {cancel, ready}}) {
    state = after(state, event);
    EXPECT_EQ(state, expected) << to_string(event);
  }
}

/// The part of docs/station.md between the two comments that name it.
void expect_in_station_page(const std::string& part, const std::string& wanted) {
  const std::filesystem::path page =
      std::filesystem::path(SKULLSTATION_SOURCE_DIR) / "docs" / "station.md";
  auto text = read_file(page);
  ASSERT_TRUE(text) << text.error().message();
  const std::string begin = "<!-- " + part + " -->\n";
  const std::string end = "<!-- end of " + part + " -->";
  const auto from = text->find(begin);
  auto to = text->find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos) << part << " has no place";
  const auto start = from + begin.size();
  const char* redraw = std::getenv("SKULLSTATION_REDRAW");
  if (redraw != nullptr && std::string(redraw) == "1") {
    text->replace(start, to - start, wanted);
    to = start + wanted.size();
    ASSERT_TRUE(write_file_durably(page, *text));
  }
  EXPECT_EQ(text->substr(start, to - start), wanted)
      << part << " in docs/station.md is stale; draw it again: SKULLSTATION_REDRAW=1 "
      << "build/release/bin/station_tests --gtest_filter='StateTable.*'";
}

TEST(StateTable, TheDrawingInTheDocumentsIsMadeFromIt) {
  expect_in_station_page("state diagram", "```mermaid\n" + testing::state_diagram() + "```\n");
  expect_in_station_page("state table", testing::state_matrix());
}

}  // namespace
}  // namespace skullstation
