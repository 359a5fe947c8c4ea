#include "tests/hardware_lab/gpio_trace.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <sstream>
#include <stdexcept>

#include "tests/hardware_lab/kernel_file.h"

namespace skullstation {
namespace {

const std::filesystem::path tracing = "/sys/kernel/tracing";

Instant instant(const std::string& seconds, const std::string& microseconds) {
  return Instant(std::chrono::seconds(std::stoll(seconds)) +
                 std::chrono::microseconds(std::stoll(microseconds)));
}

}  // namespace

GpioTrace::GpioTrace() {
  write_kernel_file(tracing / "trace_clock", "mono");  // empties the record, too
  write_kernel_file(tracing / "buffer_size_kb", "8192");
  write_kernel_file(tracing / "events/gpio/gpio_value/enable", "1");
}

GpioTrace::~GpioTrace() { write_kernel_file(tracing / "events/gpio/gpio_value/enable", "0"); }

void GpioTrace::mark(const std::string& text) { write_kernel_file(tracing / "trace_marker", text); }

std::vector<TraceEvent> GpioTrace::events() const {
  static const std::regex counts("entries-in-buffer/entries-written: (\\d+)/(\\d+)");
  static const std::regex value(" (\\d+)\\.(\\d{6}): gpio_value: (\\d+) (set|get) ([01])");
  static const std::regex marked(" (\\d+)\\.(\\d{6}): tracing_mark_write: (.*)");

  std::istringstream text(read_kernel_file(tracing / "trace"));
  std::vector<TraceEvent> events;
  std::smatch match;
  for (std::string line; std::getline(text, line);) {
    if (std::regex_search(line, match, counts) && match[1] != match[2]) {
      throw std::runtime_error("the kernel's trace is incomplete: " + line);
    }
    if (std::regex_search(line, match, value)) {
      events.push_back({match[4] == "set" ? TraceEvent::Kind::set : TraceEvent::Kind::get,
                        instant(match[1], match[2]),
                        std::stoi(match[3]),
                        std::stoi(match[5]),
                        {}});
    } else if (std::regex_search(line, match, marked)) {
      events.push_back({TraceEvent::Kind::mark, instant(match[1], match[2]), 0, 0, match[3].str()});
    }
  }
  return events;
}

std::vector<Instant> rising_edges(const std::vector<TraceEvent>& events, int line) {
  std::vector<Instant> edges;
  int level = 0;
  for (const TraceEvent& event : events) {
    if (event.kind != TraceEvent::Kind::set || event.line != line) continue;
    if (event.level == 1 && level == 0) edges.push_back(event.at);
    level = event.level;
  }
  return edges;
}

}  // namespace skullstation
