#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "firmware_io/gpio_chip.h"
#include "firmware_io/gpio_lines.h"

namespace skullstation::contract {

/// A GPIO chip in this process: what software sets can be read, what a test pulls is read by
/// software, edges queue up in a pipe as they do in the kernel. Safe from any thread.
class FakeGpio : public std::enable_shared_from_this<FakeGpio> {
 public:
  /// The levels that inputs have until they are pulled.
  using Levels = std::map<std::string, bool>;
  FakeGpio(std::string name, const Levels& lines);

  /// The chips as GpioLines takes them.
  static GpioLines::Chips chips(const std::vector<std::shared_ptr<FakeGpio>>& fakes);

  void pull(const std::string& line, bool high, Instant at = std::chrono::steady_clock::now());
  bool high(const std::string& line) const;
  /// Called, unlocked, at each change of an output.
  void on_output(std::function<void(const std::string& line, bool high)> callback);
  /// Another program has the line.
  void occupy(const std::string& line, const std::string& consumer);
  /// From now on requests of the line fail so.
  void refuse(const std::string& line, int error_number);
  /// The chip is gone: everything fails with ENODEV, polls hang up.
  void remove();

 private:
  friend class FakeGpioChip;
  friend class FakeGpioLine;

  struct Line {
    bool high = false;
    bool requested = false;
    bool active_low = false;
    int edge_sink = -1;  // the pipe's writing end
    int refusal = 0;
    std::string consumer;
  };

  const std::string name_;
  mutable std::mutex mutex_;
  std::map<std::string, Line> lines_;
  std::function<void(const std::string&, bool)> on_output_;
  bool removed_ = false;
};

}  // namespace skullstation::contract
