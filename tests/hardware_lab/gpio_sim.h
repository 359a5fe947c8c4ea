#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace skullstation {

/// A GPIO chip of the kernel's gpio-sim (Documentation/admin-guide/gpio/gpio-sim.rst) with the
/// given line names, from construction to destruction. Throws std::system_error where the kernel
/// refuses.
class GpioSim {
 public:
  GpioSim(std::string name, std::vector<std::string> line_names);
  ~GpioSim();
  GpioSim(const GpioSim&) = delete;
  GpioSim& operator=(const GpioSim&) = delete;

  /// Drives an input line from outside. Edges less than 20 ms apart may reach the kernel as one.
  void pull(const std::string& line, bool high);

  /// What a voltmeter reads at the line.
  bool level(const std::string& line) const;

  /// Takes the chip away, whoever uses it: what unplugging a USB GPIO adapter does.
  void remove();

  std::string device_path() const { return "/dev/" + chip_; }

  /// The line's number in the kernel's trace events.
  int global_number(const std::string& line) const;

 private:
  int offset(const std::string& line) const;
  std::filesystem::path attribute(const std::string& line, const char* name) const;

  std::vector<std::string> line_names_;
  std::filesystem::path config_;
  std::filesystem::path device_;
  std::string chip_;
  int base_ = 0;
};

}  // namespace skullstation
