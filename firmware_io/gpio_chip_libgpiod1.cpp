#include <gpiod.h>

#include <cerrno>

#include "firmware_io/gpio_chip.h"

namespace skullstation {

namespace {

constexpr const char* consumer_name = "skullstation";

struct CloseChip {
  void operator()(gpiod_chip* chip) const { gpiod_chip_close(chip); }
};
using ChipHandle = std::shared_ptr<gpiod_chip>;  // lines of libgpiod 1 live in their chip

class Line final : public GpioLine {
 public:
  Line(ChipHandle chip, gpiod_line* line) : chip_(std::move(chip)), line_(line) {}
  ~Line() override { gpiod_line_release(line_); }
  Line(const Line&) = delete;
  Line& operator=(const Line&) = delete;

  OrErrno<bool> active() override {
    const int value = gpiod_line_get_value(line_);
    if (value < 0) return tl::unexpected(errno);
    return value == 1;
  }
  OrErrno<void> set_active(bool active) override {
    if (gpiod_line_set_value(line_, active ? 1 : 0) < 0) return tl::unexpected(errno);
    return {};
  }
  int edge_fd() const override { return gpiod_line_event_get_fd(line_); }
  OrErrno<GpioEdge> read_edge() override {
    gpiod_line_event event{};
    if (gpiod_line_event_read(line_, &event) < 0) return tl::unexpected(errno);
    const auto at =
        std::chrono::seconds{event.ts.tv_sec} + std::chrono::nanoseconds{event.ts.tv_nsec};
    return GpioEdge{Instant{at}, event.event_type == GPIOD_LINE_EVENT_RISING_EDGE};
  }

 private:
  ChipHandle chip_;
  gpiod_line* line_;
};

int flags_of(const GpioRequest& request) {
  int flags = 0;
  if (request.active_low) flags |= GPIOD_LINE_REQUEST_FLAG_ACTIVE_LOW;
  if (request.bias == GpioBias::pull_up) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_UP;
  if (request.bias == GpioBias::pull_down) flags |= GPIOD_LINE_REQUEST_FLAG_BIAS_PULL_DOWN;
  return flags;
}

class Chip final : public GpioChip {
 public:
  explicit Chip(gpiod_chip* chip) : chip_(chip, CloseChip{}) {}

  std::string name() const override { return gpiod_chip_name(chip_.get()); }
  std::string label() const override { return gpiod_chip_label(chip_.get()); }

  std::optional<unsigned> find_line(const std::string& line_name) const override {
    gpiod_line* line = gpiod_chip_find_line(chip_.get(), line_name.c_str());
    if (line == nullptr) return std::nullopt;
    return gpiod_line_offset(line);
  }

  std::string consumer(unsigned offset) const override {
    gpiod_line* line = gpiod_chip_get_line(chip_.get(), offset);
    if (line == nullptr || gpiod_line_update(line) < 0) return {};
    const char* consumer = gpiod_line_consumer(line);
    return consumer == nullptr ? "" : consumer;
  }

  OrErrno<std::unique_ptr<GpioLine>> request(unsigned offset, const GpioRequest& request) override {
    gpiod_line* line = gpiod_chip_get_line(chip_.get(), offset);
    if (line == nullptr) return tl::unexpected(errno);
    const int flags = flags_of(request);
    const int failed =
        request.output  ? gpiod_line_request_output_flags(line, consumer_name, flags, 0)
        : request.edges ? gpiod_line_request_both_edges_events_flags(line, consumer_name, flags)
                        : gpiod_line_request_input_flags(line, consumer_name, flags);
    if (failed != 0) return tl::unexpected(errno);
    return std::make_unique<Line>(chip_, line);
  }

 private:
  ChipHandle chip_;
};

}  // namespace

OrErrno<std::unique_ptr<GpioChip>> open_gpio_chip(const std::string& path) {
  gpiod_chip* chip = gpiod_chip_open(path.c_str());
  if (chip == nullptr) return tl::unexpected(errno);
  return std::make_unique<Chip>(chip);
}

}  // namespace skullstation
