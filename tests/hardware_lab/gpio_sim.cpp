#include "tests/hardware_lab/gpio_sim.h"

#include <algorithm>
#include <stdexcept>
#include <system_error>

#include "tests/hardware_lab/kernel_file.h"

namespace skullstation {
namespace fs = std::filesystem;

GpioSim::GpioSim(std::string name, std::vector<std::string> line_names)
    : line_names_(std::move(line_names)), config_("/sys/kernel/config/gpio-sim/" + name) {
  const fs::path bank = config_ / "bank";
  fs::create_directory(config_);
  fs::create_directory(bank);
  write_kernel_file(bank / "num_lines", std::to_string(line_names_.size()));
  write_kernel_file(bank / "label", name);
  for (std::size_t i = 0; i < line_names_.size(); ++i) {
    const fs::path line = bank / ("line" + std::to_string(i));
    fs::create_directory(line);
    write_kernel_file(line / "name", line_names_[i]);
  }
  write_kernel_file(config_ / "live", "1");

  device_ = fs::path("/sys/devices/platform") / read_kernel_file(config_ / "dev_name");
  chip_ = read_kernel_file(bank / "chip_name");
  base_ = std::stoi(read_kernel_file(fs::directory_iterator(device_ / "gpio")->path() / "base"));
}

GpioSim::~GpioSim() {
  remove();
  std::error_code ignored;
  for (std::size_t i = 0; i < line_names_.size(); ++i) {
    fs::remove(config_ / "bank" / ("line" + std::to_string(i)), ignored);
  }
  fs::remove(config_ / "bank", ignored);
  fs::remove(config_, ignored);
}

void GpioSim::pull(const std::string& line, bool high) {
  write_kernel_file(attribute(line, "pull"), high ? "pull-up" : "pull-down");
}

bool GpioSim::level(const std::string& line) const {
  return read_kernel_file(attribute(line, "value")) == "1";
}

void GpioSim::remove() {
  if (read_kernel_file(config_ / "live") == "1") write_kernel_file(config_ / "live", "0");
}

int GpioSim::global_number(const std::string& line) const { return base_ + offset(line); }

int GpioSim::offset(const std::string& line) const {
  const auto found = std::find(line_names_.begin(), line_names_.end(), line);
  if (found == line_names_.end()) throw std::invalid_argument("no line " + line);
  return static_cast<int>(found - line_names_.begin());
}

fs::path GpioSim::attribute(const std::string& line, const char* name) const {
  return device_ / chip_ / ("sim_gpio" + std::to_string(offset(line))) / name;
}

}  // namespace skullstation
