#include <gpiod.h>

#include <cerrno>

#include "firmware_io/gpio_chip.h"

namespace skullstation {

namespace {

/// Owns one of libgpiod's objects.
template <auto release>
struct Releaser {
  template <class T>
  void operator()(T* object) const {
    release(object);
  }
};
using ChipHandle = std::unique_ptr<gpiod_chip, Releaser<gpiod_chip_close>>;
using ChipInfo = std::unique_ptr<gpiod_chip_info, Releaser<gpiod_chip_info_free>>;
using LineInfo = std::unique_ptr<gpiod_line_info, Releaser<gpiod_line_info_free>>;
using LineSettings = std::unique_ptr<gpiod_line_settings, Releaser<gpiod_line_settings_free>>;
using LineConfig = std::unique_ptr<gpiod_line_config, Releaser<gpiod_line_config_free>>;
using RequestConfig = std::unique_ptr<gpiod_request_config, Releaser<gpiod_request_config_free>>;
using RequestHandle = std::unique_ptr<gpiod_line_request, Releaser<gpiod_line_request_release>>;
using EdgeBuffer = std::unique_ptr<gpiod_edge_event_buffer, Releaser<gpiod_edge_event_buffer_free>>;

class Line final : public GpioLine {
 public:
  Line(RequestHandle request, unsigned offset, EdgeBuffer edges)
      : request_(std::move(request)), offset_(offset), edges_(std::move(edges)) {}

  OrErrno<bool> active() override {
    const gpiod_line_value value = gpiod_line_request_get_value(request_.get(), offset_);
    if (value == GPIOD_LINE_VALUE_ERROR) return tl::unexpected(errno);
    return value == GPIOD_LINE_VALUE_ACTIVE;
  }
  OrErrno<void> set_active(bool active) override {
    const auto value = active ? GPIOD_LINE_VALUE_ACTIVE : GPIOD_LINE_VALUE_INACTIVE;
    if (gpiod_line_request_set_value(request_.get(), offset_, value) < 0) {
      return tl::unexpected(errno);
    }
    return {};
  }
  int edge_fd() const override { return edges_ ? gpiod_line_request_get_fd(request_.get()) : -1; }
  OrErrno<GpioEdge> read_edge() override {
    if (gpiod_line_request_read_edge_events(request_.get(), edges_.get(), 1) < 1) {
      return tl::unexpected(errno);
    }
    gpiod_edge_event* event = gpiod_edge_event_buffer_get_event(edges_.get(), 0);
    const std::chrono::nanoseconds at{gpiod_edge_event_get_timestamp_ns(event)};
    return GpioEdge{Instant{at},
                    gpiod_edge_event_get_event_type(event) == GPIOD_EDGE_EVENT_RISING_EDGE};
  }

 private:
  RequestHandle request_;
  unsigned offset_;
  EdgeBuffer edges_;
};

gpiod_line_bias bias_of(GpioBias bias) {
  switch (bias) {
    case GpioBias::as_wired: break;
    case GpioBias::pull_up: return GPIOD_LINE_BIAS_PULL_UP;
    case GpioBias::pull_down: return GPIOD_LINE_BIAS_PULL_DOWN;
  }
  return GPIOD_LINE_BIAS_AS_IS;
}

class Chip final : public GpioChip {
 public:
  explicit Chip(ChipHandle chip) : chip_(std::move(chip)) {
    const ChipInfo info(gpiod_chip_get_info(chip_.get()));
    if (!info) return;
    name_ = gpiod_chip_info_get_name(info.get());
    label_ = gpiod_chip_info_get_label(info.get());
  }

  std::string name() const override { return name_; }
  std::string label() const override { return label_; }

  std::optional<unsigned> find_line(const std::string& line_name) const override {
    const int offset = gpiod_chip_get_line_offset_from_name(chip_.get(), line_name.c_str());
    if (offset < 0) return std::nullopt;
    return static_cast<unsigned>(offset);
  }

  std::string consumer(unsigned offset) const override {
    const LineInfo info(gpiod_chip_get_line_info(chip_.get(), offset));
    const char* consumer = info ? gpiod_line_info_get_consumer(info.get()) : nullptr;
    return consumer == nullptr ? "" : consumer;
  }

  OrErrno<std::unique_ptr<GpioLine>> request(unsigned offset, const GpioRequest& request) override {
    const LineSettings settings(gpiod_line_settings_new());
    const LineConfig line_config(gpiod_line_config_new());
    const RequestConfig request_config(gpiod_request_config_new());
    EdgeBuffer edges(request.edges ? gpiod_edge_event_buffer_new(1) : nullptr);
    if (!settings || !line_config || !request_config || (request.edges && !edges)) {
      return tl::unexpected(ENOMEM);
    }
    gpiod_line_settings_set_direction(
        settings.get(), request.output ? GPIOD_LINE_DIRECTION_OUTPUT : GPIOD_LINE_DIRECTION_INPUT);
    gpiod_line_settings_set_active_low(settings.get(), request.active_low);
    gpiod_line_settings_set_bias(settings.get(), bias_of(request.bias));
    gpiod_line_settings_set_edge_detection(
        settings.get(), request.edges ? GPIOD_LINE_EDGE_BOTH : GPIOD_LINE_EDGE_NONE);
    gpiod_line_settings_set_event_clock(settings.get(), GPIOD_LINE_CLOCK_MONOTONIC);
    gpiod_line_settings_set_output_value(settings.get(), GPIOD_LINE_VALUE_INACTIVE);
    gpiod_request_config_set_consumer(request_config.get(), "skullstation");
    if (gpiod_line_config_add_line_settings(line_config.get(), &offset, 1, settings.get()) < 0) {
      return tl::unexpected(errno);
    }
    RequestHandle handle(
        gpiod_chip_request_lines(chip_.get(), request_config.get(), line_config.get()));
    if (!handle) return tl::unexpected(errno);
    return std::make_unique<Line>(std::move(handle), offset, std::move(edges));
  }

 private:
  ChipHandle chip_;
  std::string name_;
  std::string label_;
};

}  // namespace

OrErrno<std::unique_ptr<GpioChip>> open_gpio_chip(const std::string& path) {
  ChipHandle chip(gpiod_chip_open(path.c_str()));
  if (!chip) return tl::unexpected(errno);
  return std::make_unique<Chip>(std::move(chip));
}

}  // namespace skullstation
