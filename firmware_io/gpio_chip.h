#pragma once

#include <memory>
#include <optional>
#include <string>
#include <tl/expected.hpp>
#include <vector>

#include "core/clock.h"

namespace skullstation {

/// What the kernel's GPIO character devices offer, as far as a station needs it. One of
/// gpio_chip_libgpiod1.cpp (Debian 12) and gpio_chip_libgpiod2.cpp (Debian 13) is built; nothing
/// else knows libgpiod. Failures are errno values: the callers know what the lines are for.
template <class T>
using OrErrno = tl::expected<T, int>;

enum class GpioBias { as_wired, pull_up, pull_down };

struct GpioRequest {
  bool output = false;  ///< driven inactive from the request on; otherwise an input
  bool active_low = false;
  GpioBias bias = GpioBias::as_wired;
  bool edges = false;  ///< an input whose edges are queued by the kernel
};

struct GpioEdge {
  Instant at;           ///< when the kernel saw it
  bool active = false;  ///< the level after it
};

/// A line that was requested; released by the destructor. Not thread-safe.
class GpioLine {
 public:
  virtual ~GpioLine() = default;
  virtual OrErrno<bool> active() = 0;
  virtual OrErrno<void> set_active(bool active) = 0;
  /// Readable when an edge is queued; -1 without `edges`.
  virtual int edge_fd() const = 0;
  /// The oldest queued edge; blocks if there is none.
  virtual OrErrno<GpioEdge> read_edge() = 0;
};

class GpioChip {
 public:
  virtual ~GpioChip() = default;
  virtual std::string name() const = 0;   ///< "gpiochip0"
  virtual std::string label() const = 0;  ///< "pinctrl-bcm2711"
  virtual std::optional<unsigned> find_line(const std::string& line_name) const = 0;
  /// Who holds the line; empty if nobody, or nobody known.
  virtual std::string consumer(unsigned offset) const = 0;
  virtual OrErrno<std::unique_ptr<GpioLine>> request(unsigned offset,
                                                     const GpioRequest& request) = 0;
};

OrErrno<std::unique_ptr<GpioChip>> open_gpio_chip(const std::string& path);

}  // namespace skullstation
