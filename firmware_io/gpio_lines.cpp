#include "firmware_io/gpio_lines.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <system_error>

namespace skullstation {

namespace {

constexpr auto permission_advice = "add this user to the group gpio (docs/hardware.md)";

std::string reason(int error_number) { return std::system_category().message(error_number); }

std::string line_called(const std::string& name) { return fmt::format("GPIO line \"{}\"", name); }

tl::unexpected<Error> line_error(const std::string& name, const char* action, int error_number) {
  if (error_number == ENODEV) {
    return fail(ErrorKind::hardware, line_called(name), "GPIO chip is gone",
                "reconnect it, then start the station again");
  }
  return fail(ErrorKind::hardware, line_called(name),
              fmt::format("can't be {} ({})", action, reason(error_number)));
}

std::string described(const GpioChip& chip) {
  return fmt::format("{} [{}]", chip.name(), chip.label());
}

std::string described(const GpioLines::Chips& chips) {
  std::string text;
  for (const auto& chip : chips) text += (text.empty() ? "" : ", ") + described(*chip);
  return text;
}

std::vector<std::string> chip_paths() {
  std::vector<std::string> paths;
  std::error_code ignored;
  for (const auto& entry : std::filesystem::directory_iterator("/dev", ignored)) {
    if (entry.path().filename().string().starts_with("gpiochip")) paths.push_back(entry.path());
  }
  std::ranges::sort(paths);
  return paths;
}

}  // namespace

Result<bool> NamedLine::active() {
  if (!line_) return false;
  const std::lock_guard lock(*mutex_);
  const auto active = line_->active();
  if (!active) return line_error(name_, "read", active.error());
  return *active;
}

Result<void> NamedLine::set(bool active) {
  if (!line_) return {};
  const std::lock_guard lock(*mutex_);
  if (const auto set = line_->set_active(active); !set) {
    return line_error(name_, "set", set.error());
  }
  return {};
}

Result<GpioEdge> NamedLine::read_edge() {
  const std::lock_guard lock(*mutex_);
  const auto edge = line_->read_edge();
  if (!edge) return line_error(name_, "read", edge.error());
  return *edge;
}

Result<GpioLines> GpioLines::open(const std::string& chip) {
  Chips chips;
  std::string refused;
  int refusal = 0;
  for (const std::string& path : chip_paths()) {
    auto opened = open_gpio_chip(path);
    if (!opened) {
      refused += (refused.empty() ? "" : ", ") + path;
      refusal = opened.error();
      continue;
    }
    const bool wanted =
        chip.empty() || chip == path || chip == (*opened)->name() || chip == (*opened)->label();
    if (wanted) chips.push_back(*std::move(opened));
  }
  if (!chips.empty()) return GpioLines(std::move(chips));
  if (!refused.empty()) {
    return fail(ErrorKind::hardware, refused, fmt::format("can't be opened ({})", reason(refusal)),
                refusal == EACCES ? permission_advice : "");
  }
  return fail(ErrorKind::hardware, "gpio.chip",
              chip.empty() ? "this machine has no GPIO chip"
                           : fmt::format("no GPIO chip is called \"{}\"", chip),
              "`gpiodetect` lists the chips");
}

Result<NamedLine> GpioLines::output(const GpioWire& wire) {
  return request(wire, {.output = true, .active_low = wire.active_low});
}

Result<NamedLine> GpioLines::input(const GpioWire& wire) {
  return request(wire, {.active_low = wire.active_low, .bias = wire.bias});
}

Result<NamedLine> GpioLines::input_with_edges(const GpioWire& wire) {
  return request(wire, {.active_low = wire.active_low, .bias = wire.bias, .edges = true});
}

Result<NamedLine> GpioLines::request(const GpioWire& wire, const GpioRequest& request) {
  if (wire.name.empty()) return NamedLine{};
  GpioChip* home = nullptr;
  unsigned offset = 0;
  for (const auto& chip : chips_) {
    const auto found = chip->find_line(wire.name);
    if (!found) continue;
    if (home != nullptr) {
      return fail(ErrorKind::hardware, line_called(wire.name),
                  fmt::format("is on {} and on {}", described(*home), described(*chip)),
                  "choose one of them by gpio.chip");
    }
    home = chip.get();
    offset = *found;
  }
  if (home == nullptr) {
    return fail(ErrorKind::hardware, line_called(wire.name),
                fmt::format("not found on {}", described(chips_)),
                "`gpioinfo` lists the lines; put the right one into the [gpio] tables");
  }
  auto line = home->request(offset, request);
  if (line) return NamedLine(wire.name, *std::move(line));
  if (line.error() == ENXIO && request.edges) {
    return fail(ErrorKind::hardware, line_called(wire.name), "has no interrupt: it can't be heard",
                "connect this wire to a line of the processor itself");
  }
  if (line.error() != EBUSY) return line_error(wire.name, "requested", line.error());
  const std::string holder = home->consumer(offset);
  return fail(ErrorKind::hardware, line_called(wire.name),
              holder.empty() ? "is in use" : fmt::format("is in use by \"{}\"", holder),
              "end the program that holds it; `gpioinfo` shows which");
}

}  // namespace skullstation
