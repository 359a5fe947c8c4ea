#include "tests/hardware_lab/watched_chip.h"

#include <system_error>

namespace skullstation {
namespace {

class WatchedLine final : public GpioLine {
 public:
  WatchedLine(std::unique_ptr<GpioLine> line, std::function<void()> active)
      : line_(std::move(line)), active_(std::move(active)) {}

  OrErrno<bool> active() override { return line_->active(); }
  OrErrno<void> set_active(bool active) override {
    const auto set = line_->set_active(active);
    if (set && active) active_();
    return set;
  }
  int edge_fd() const override { return line_->edge_fd(); }
  OrErrno<GpioEdge> read_edge() override { return line_->read_edge(); }

 private:
  std::unique_ptr<GpioLine> line_;
  std::function<void()> active_;
};

class WatchedChip final : public GpioChip {
 public:
  WatchedChip(std::unique_ptr<GpioChip> chip, std::string line, std::function<void()> active)
      : chip_(std::move(chip)), line_(std::move(line)), active_(std::move(active)) {}

  std::string name() const override { return chip_->name(); }
  std::string label() const override { return chip_->label(); }
  std::optional<unsigned> find_line(const std::string& line_name) const override {
    return chip_->find_line(line_name);
  }
  std::string consumer(unsigned offset) const override { return chip_->consumer(offset); }
  OrErrno<std::unique_ptr<GpioLine>> request(unsigned offset, const GpioRequest& request) override {
    auto line = chip_->request(offset, request);
    if (!line || offset != chip_->find_line(line_)) return line;
    return std::make_unique<WatchedLine>(*std::move(line), active_);
  }

 private:
  std::unique_ptr<GpioChip> chip_;
  std::string line_;
  std::function<void()> active_;
};

}  // namespace

std::unique_ptr<GpioChip> open_watched_chip(const std::string& path, const std::string& line,
                                            std::function<void()> active) {
  auto chip = open_gpio_chip(path);
  if (!chip) throw std::system_error(chip.error(), std::generic_category(), path);
  return std::make_unique<WatchedChip>(*std::move(chip), line, std::move(active));
}

}  // namespace skullstation
