#include "tests/contract/fake_gpio.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <iterator>
#include <utility>

namespace skullstation::contract {

class FakeGpioLine final : public GpioLine {
 public:
  FakeGpioLine(std::shared_ptr<FakeGpio> fake, std::string name, int edge_source)
      : fake_(std::move(fake)), name_(std::move(name)), edge_source_(edge_source) {}

  ~FakeGpioLine() override {
    const std::lock_guard lock(fake_->mutex_);
    FakeGpio::Line& line = fake_->lines_.at(name_);
    line.requested = false;
    if (line.edge_sink >= 0) ::close(std::exchange(line.edge_sink, -1));
    if (edge_source_ >= 0) ::close(edge_source_);
  }
  FakeGpioLine(const FakeGpioLine&) = delete;
  FakeGpioLine& operator=(const FakeGpioLine&) = delete;

  OrErrno<bool> active() override {
    const std::lock_guard lock(fake_->mutex_);
    if (fake_->removed_) return tl::unexpected(ENODEV);
    const FakeGpio::Line& line = fake_->lines_.at(name_);
    return line.high != line.active_low;
  }

  OrErrno<void> set_active(bool active) override {
    std::function<void(const std::string&, bool)> tell;
    bool high = false;
    {
      const std::lock_guard lock(fake_->mutex_);
      if (fake_->removed_) return tl::unexpected(ENODEV);
      FakeGpio::Line& line = fake_->lines_.at(name_);
      high = active != line.active_low;
      if (std::exchange(line.high, high) != high) tell = fake_->on_output_;
    }
    if (tell) tell(name_, high);
    return {};
  }

  int edge_fd() const override { return edge_source_; }

  OrErrno<GpioEdge> read_edge() override {
    GpioEdge edge;
    if (::read(edge_source_, &edge, sizeof edge) != sizeof edge) return tl::unexpected(ENODEV);
    return edge;
  }

 private:
  std::shared_ptr<FakeGpio> fake_;
  std::string name_;
  int edge_source_;
};

class FakeGpioChip final : public GpioChip {
 public:
  explicit FakeGpioChip(std::shared_ptr<FakeGpio> fake) : fake_(std::move(fake)) {}

  std::string name() const override { return fake_->name_; }
  std::string label() const override { return "fake"; }

  std::optional<unsigned> find_line(const std::string& line_name) const override {
    const auto found = fake_->lines_.find(line_name);
    if (found == fake_->lines_.end()) return std::nullopt;
    return static_cast<unsigned>(std::distance(fake_->lines_.begin(), found));
  }

  std::string consumer(unsigned offset) const override { return line(offset).second.consumer; }

  OrErrno<std::unique_ptr<GpioLine>> request(unsigned offset, const GpioRequest& request) override {
    const std::lock_guard lock(fake_->mutex_);
    auto& [name, wanted] = line(offset);
    if (wanted.refusal != 0) return tl::unexpected(wanted.refusal);
    if (wanted.requested) return tl::unexpected(EBUSY);
    std::array ends{-1, -1};
    if (request.edges && ::pipe2(ends.data(), O_CLOEXEC) != 0) return tl::unexpected(errno);
    wanted.requested = true;
    wanted.active_low = request.active_low;
    wanted.edge_sink = ends[1];
    if (request.output) wanted.high = request.active_low;
    return std::make_unique<FakeGpioLine>(fake_, name, ends[0]);
  }

 private:
  std::pair<const std::string, FakeGpio::Line>& line(unsigned offset) const {
    return *std::next(fake_->lines_.begin(), offset);
  }

  std::shared_ptr<FakeGpio> fake_;
};

FakeGpio::FakeGpio(std::string name, const Levels& lines) : name_(std::move(name)) {
  for (const auto& [line, high] : lines) lines_[line].high = high;
}

GpioLines::Chips FakeGpio::chips(const std::vector<std::shared_ptr<FakeGpio>>& fakes) {
  GpioLines::Chips chips;
  for (const auto& fake : fakes) chips.push_back(std::make_unique<FakeGpioChip>(fake));
  return chips;
}

void FakeGpio::pull(const std::string& name, bool high, Instant at) {
  const std::lock_guard lock(mutex_);
  Line& line = lines_.at(name);
  if (std::exchange(line.high, high) == high || line.edge_sink < 0) return;
  const GpioEdge edge{at, high != line.active_low};
  if (::write(line.edge_sink, &edge, sizeof edge) != sizeof edge) std::abort();
}

bool FakeGpio::high(const std::string& line) const {
  const std::lock_guard lock(mutex_);
  return lines_.at(line).high;
}

void FakeGpio::on_output(std::function<void(const std::string&, bool)> callback) {
  const std::lock_guard lock(mutex_);
  on_output_ = std::move(callback);
}

void FakeGpio::occupy(const std::string& line, const std::string& consumer) {
  const std::lock_guard lock(mutex_);
  lines_.at(line).requested = true;
  lines_.at(line).consumer = consumer;
}

void FakeGpio::refuse(const std::string& line, int error_number) {
  const std::lock_guard lock(mutex_);
  lines_.at(line).refusal = error_number;
}

void FakeGpio::remove() {
  const std::lock_guard lock(mutex_);
  removed_ = true;
  for (auto& [name, line] : lines_) {
    if (line.edge_sink >= 0) ::close(std::exchange(line.edge_sink, -1));
  }
}

}  // namespace skullstation::contract
