#include "tests/hardware_lab/kernel_trace.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <system_error>

#include "tests/hardware_lab/kernel_file.h"

namespace skullstation {
namespace {

const std::filesystem::path tracing = "/sys/kernel/tracing";

/// Empties the record and lets it begin.
void record(const std::string& event) {
  write_kernel_file(tracing / "trace_clock", "mono");  // empties the record, too
  write_kernel_file(tracing / "buffer_size_kb", "8192");
  // An event stays enabled for good: enabling changes the kernel's code, which the emulator that
  // the lab runs in does not always survive.
  const auto enable = tracing / "events" / event / "enable";
  if (read_kernel_file(enable) != "1") write_kernel_file(enable, "1");
  write_kernel_file(tracing / "tracing_on", "1");
}

std::optional<TraceEvent> parse_event(const std::string& line) {
  static const std::regex entry(" (\\d+)\\.(\\d{6}): (\\w+): (.*)");
  std::smatch match;
  if (!std::regex_search(line, match, entry)) return std::nullopt;
  return TraceEvent{Instant(std::chrono::seconds(std::stoll(match[1])) +
                            std::chrono::microseconds(std::stoll(match[2]))),
                    match[3], match[4]};
}

}  // namespace

KernelTrace::KernelTrace(const std::string& event) { record(event); }

KernelTrace::~KernelTrace() { write_kernel_file(tracing / "tracing_on", "0"); }

void KernelTrace::mark(const std::string& text) {
  write_kernel_file(tracing / "trace_marker", text);
}

std::vector<TraceEvent> KernelTrace::events() const {
  static const std::regex counts("entries-in-buffer/entries-written: (\\d+)/(\\d+)");

  std::istringstream text(read_kernel_file(tracing / "trace"));
  std::vector<TraceEvent> events;
  std::smatch match;
  for (std::string line; std::getline(text, line);) {
    if (std::regex_search(line, match, counts) && match[1] != match[2]) {
      throw std::runtime_error("the kernel's trace is incomplete: " + line);
    }
    if (auto event = parse_event(line)) events.push_back(*std::move(event));
  }
  return events;
}

LiveKernelTrace::LiveKernelTrace(const std::string& event)
    : pipe_(::open((tracing / "trace_pipe").c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC)) {
  if (pipe_ < 0) throw std::system_error(errno, std::generic_category(), "trace_pipe");
  record(event);
}

LiveKernelTrace::~LiveKernelTrace() {
  ::close(pipe_);
  write_kernel_file(tracing / "tracing_on", "0");
}

std::vector<TraceEvent> LiveKernelTrace::next(std::chrono::milliseconds timeout) {
  pollfd waiting{pipe_, POLLIN, 0};
  std::vector<TraceEvent> events;
  if (::poll(&waiting, 1, static_cast<int>(timeout.count())) <= 0) return events;
  std::array<char, 4096> part;
  for (ssize_t read = 0; (read = ::read(pipe_, part.data(), part.size())) > 0;) {
    rest_.append(part.data(), static_cast<std::size_t>(read));
  }
  std::size_t begin = 0;
  for (std::size_t end = 0; (end = rest_.find('\n', begin)) != std::string::npos; begin = end + 1) {
    if (auto event = parse_event(rest_.substr(begin, end - begin))) {
      events.push_back(*std::move(event));
    }
  }
  rest_.erase(0, begin);
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
