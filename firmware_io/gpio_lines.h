#pragma once

#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/result.h"
#include "firmware_io/gpio_chip.h"

namespace skullstation {

/// A wire, named as the kernel names its line (`gpioinfo` lists them). Empty: not fitted.
struct GpioWire {
  std::string name;
  bool active_low = false;
  GpioBias bias = GpioBias::as_wired;  ///< inputs only
};

/// A line in a station's terms: its failures name it and say what to do. One that is not fitted
/// is never active and may be set without effect. Safe from any thread.
class NamedLine {
 public:
  NamedLine() = default;
  NamedLine(std::string name, std::unique_ptr<GpioLine> line)
      : name_(std::move(name)), line_(std::move(line)) {}

  bool fitted() const { return line_ != nullptr; }
  const std::string& name() const { return name_; }

  Result<bool> active();
  Result<void> set(bool active);
  int edge_fd() const { return line_ ? line_->edge_fd() : -1; }
  Result<GpioEdge> read_edge();

 private:
  std::string name_;
  std::unique_ptr<GpioLine> line_;
  std::unique_ptr<std::mutex> mutex_ = std::make_unique<std::mutex>();  // so that lines can move
};

/// The chips of this machine, in which lines are looked up by name.
class GpioLines {
 public:
  using Chips = std::vector<std::unique_ptr<GpioChip>>;
  explicit GpioLines(Chips chips) : chips_(std::move(chips)) {}

  /// All chips under /dev, or the one with this name ("gpiochip0"), label or path.
  static Result<GpioLines> open(const std::string& chip);

  Result<NamedLine> output(const GpioWire& wire);
  Result<NamedLine> input(const GpioWire& wire);
  Result<NamedLine> input_with_edges(const GpioWire& wire);

 private:
  Result<NamedLine> request(const GpioWire& wire, const GpioRequest& request);

  Chips chips_;
};

}  // namespace skullstation
