#include "tests/hardware_lab/kernel_trace.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "tests/hardware_lab/kernel_file.h"

namespace skullstation {
namespace {

const std::filesystem::path tracing = "/sys/kernel/tracing";

}  // namespace

KernelTrace::KernelTrace(const std::string& event) {
  write_kernel_file(tracing / "trace_clock", "mono");  // empties the record, too
  write_kernel_file(tracing / "buffer_size_kb", "8192");
  // An event stays enabled for good: enabling changes the kernel's code, which the emulator that
  // the lab runs in does not always survive.
  const auto enable = tracing / "events" / event / "enable";
  if (read_kernel_file(enable) != "1") write_kernel_file(enable, "1");
  write_kernel_file(tracing / "tracing_on", "1");
}

KernelTrace::~KernelTrace() { write_kernel_file(tracing / "tracing_on", "0"); }

void KernelTrace::mark(const std::string& text) {
  write_kernel_file(tracing / "trace_marker", text);
}

std::vector<TraceEvent> KernelTrace::events() const {
  static const std::regex counts("entries-in-buffer/entries-written: (\\d+)/(\\d+)");
  static const std::regex entry(" (\\d+)\\.(\\d{6}): (\\w+): (.*)");

  std::istringstream text(read_kernel_file(tracing / "trace"));
  std::vector<TraceEvent> events;
  std::smatch match;
  for (std::string line; std::getline(text, line);) {
    if (std::regex_search(line, match, counts) && match[1] != match[2]) {
      throw std::runtime_error("the kernel's trace is incomplete: " + line);
    }
    if (std::regex_search(line, match, entry)) {
      events.push_back({Instant(std::chrono::seconds(std::stoll(match[1])) +
                                std::chrono::microseconds(std::stoll(match[2]))),
                        match[3], match[4]});
    }
  }
  return events;
}

std::vector<LineChange> changes_of_line(const std::vector<TraceEvent>& events, int global_number) {
  const std::string set = std::to_string(global_number) + " set ";
  std::vector<LineChange> changes;
  bool level = false;
  for (const TraceEvent& event : events) {
    if (event.name != "gpio_value" || !event.text.starts_with(set)) continue;
    const bool high = event.text.back() == '1';
    if (high != level) changes.push_back({event.at, high});
    level = high;
  }
  return changes;
}

std::vector<Instant> rising_edges(const std::vector<TraceEvent>& events, int global_number) {
  std::vector<Instant> edges;
  for (const LineChange& change : changes_of_line(events, global_number)) {
    if (change.high) edges.push_back(change.at);
  }
  return edges;
}

Instant time_of_mark(const std::vector<TraceEvent>& events, const std::string& mark) {
  const auto found = std::find_if(events.begin(), events.end(), [&](const TraceEvent& event) {
    return event.name == "tracing_mark_write" && event.text == mark;
  });
  if (found == events.end()) throw std::out_of_range("no mark " + mark);
  return found->at;
}

std::vector<std::uint32_t> damaged_buffers(const std::vector<TraceEvent>& events) {
  static const std::regex damaged("flags = [A-Z_|]*ERROR.* sequence = (\\d+)");
  std::vector<std::uint32_t> sequences;
  std::smatch match;
  for (const TraceEvent& event : events) {
    if (event.name == "v4l2_dqbuf" && std::regex_search(event.text, match, damaged)) {
      sequences.push_back(static_cast<std::uint32_t>(std::stoul(match[1])));
    }
  }
  return sequences;
}

}  // namespace skullstation
