#include "firmware_io/gpio_panel.h"

#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <system_error>
#include <utility>

#include "firmware_io/real_time.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr auto estop_text = "emergency stop pressed";
constexpr auto door_text = "door open";
constexpr auto chip_gone_text = "GPIO chip is gone";
constexpr std::chrono::milliseconds longest_wait = std::chrono::hours{24 * 365};
/// The levels are looked at this often even if no edge was told of (not every kernel wakes a poll
/// when a chip is removed, and a full edge queue drops edges).
constexpr auto level_check_period = 250ms;

}  // namespace

GpioPanel::GpioPanel(GpioPanelLines lines, const ButtonTiming& timing, Clock& clock, int wake_fd)
    : lines_(std::move(lines)),
      clock_(clock),
      wake_fd_(wake_fd),
      detector_(timing),
      latch_({[this] { return still_active(); }, [this] { cut_current(); }}) {
  trip_if_active();
  listener_ = std::jthread([this] { listen(); });
}

GpioPanel::~GpioPanel() {
  ::eventfd_write(wake_fd_, 1);
  listener_.join();
  ::close(wake_fd_);
}

Result<std::optional<Press>> GpioPanel::wait_for_press(std::chrono::milliseconds timeout,
                                                       const std::stop_token& stop) {
  const Instant deadline = clock_.now() + std::min(timeout, longest_wait);
  std::unique_lock lock(mutex_);
  pressed_.wait_until(lock, stop, deadline, [&] { return !presses_.empty() || deaf_; });
  if (!presses_.empty()) {
    const Press press = presses_.front();
    presses_.pop_front();
    return press;
  }
  if (deaf_) return tl::unexpected(*deaf_);
  return std::nullopt;
}

Result<std::string> GpioPanel::still_active() {
  const auto estop = lines_.estop.active();
  if (!estop) return forward(estop);
  if (*estop) return estop_text;
  const auto door = lines_.door.active();
  if (!door) return forward(door);
  return *door ? door_text : "";
}

void GpioPanel::cut_current() {
  // If the line can't be reached, the turntable's next step fails with the reason.
  static_cast<void>(lines_.enable.set(false));
}

/// False if the lines can't be read any more.
bool GpioPanel::trip_if_active() {
  const auto active = still_active();
  if (!active) {
    go_deaf(active.error());
  } else if (!active->empty()) {
    latch_.trip(*active);
  }
  return active.has_value();
}

void GpioPanel::go_deaf(Error error) {
  {
    const std::lock_guard lock(mutex_);
    deaf_ = std::move(error);
  }
  pressed_.notify_all();
  latch_.trip(chip_gone_text);
}

void GpioPanel::listen() {
  // Best effort: how stepping itself fares is in the turntable's diagnostics.
  static_cast<void>(make_this_thread_real_time(interlock_priority));
  const auto poll_for = [](int fd) { return pollfd{fd, POLLIN, 0}; };  // fd < 0 is passed over
  std::array fds{poll_for(wake_fd_), poll_for(lines_.estop.edge_fd()),
                 poll_for(lines_.door.edge_fd()), poll_for(lines_.button.edge_fd())};
  const auto& [woken, estop, door, button] = fds;
  for (;;) {
    const Instant before = clock_.now();
    if (::poll(fds.data(), fds.size(), milliseconds_to_wait(before)) < 0) {
      if (errno == EINTR) continue;
      return go_deaf({ErrorKind::hardware, "GPIO", std::system_category().message(errno), ""});
    }
    if (woken.revents != 0) return;
    const bool hung_up = std::ranges::any_of(
        fds, [](const pollfd& fd) { return (fd.revents & (POLLERR | POLLHUP | POLLNVAL)) != 0; });
    if (hung_up) {
      return go_deaf({ErrorKind::hardware, "GPIO", chip_gone_text,
                      "reconnect it, then start the station again"});
    }
    const bool heard = (estop.revents == 0 || hear_stop(lines_.estop, estop_text)) &&
                       (door.revents == 0 || hear_stop(lines_.door, door_text)) &&
                       (button.revents == 0 || hear_button()) && trip_if_active();
    if (!heard) return;
    // With no edge queued, all that happened before the poll was heard.
    if (button.revents == 0) tell_presses(before);
  }
}

int GpioPanel::milliseconds_to_wait(Instant now) const {
  const Instant next =
      std::min(detector_.next_decision().value_or(Instant::max()), now + level_check_period);
  const auto wait = std::chrono::ceil<std::chrono::milliseconds>(next - now);
  return static_cast<int>(std::max(0ms, wait).count());
}

/// Not debounced: the first edge counts.
bool GpioPanel::hear_stop(NamedLine& line, const char* text) {
  const auto edge = line.read_edge();
  if (!edge) {
    go_deaf(edge.error());
  } else if (edge->active) {
    latch_.trip(text);
  }
  return edge.has_value();
}

bool GpioPanel::hear_button() {
  const auto edge = lines_.button.read_edge();
  if (!edge) {
    go_deaf(edge.error());
  } else {
    detector_.edge(edge->at, edge->active);
  }
  return edge.has_value();
}

void GpioPanel::tell_presses(Instant until) {
  const auto detected = detector_.advance(until);
  if (detected.empty()) return;
  {
    const std::lock_guard lock(mutex_);
    for (const auto& press : detected) presses_.push_back(press.press);
  }
  pressed_.notify_all();
}

}  // namespace skullstation
