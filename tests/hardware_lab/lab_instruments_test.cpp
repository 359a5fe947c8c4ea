// Does the lab measure right? The kernel's record must hold exactly what was driven, before any
// of the station's own code is judged by it.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <linux/gpio.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cstring>

#include "tests/hardware_lab/gpio_sim.h"
#include "tests/hardware_lab/kernel_trace.h"

namespace skullstation {
namespace {

class OutputLine {
 public:
  OutputLine(const std::string& chip_path, unsigned offset) {
    const int chip = ::open(chip_path.c_str(), O_RDWR | O_CLOEXEC);
    gpio_v2_line_request request{};
    request.offsets[0] = offset;
    request.num_lines = 1;
    std::strcpy(request.consumer, "instrument test");
    request.config.flags = GPIO_V2_LINE_FLAG_OUTPUT;
    if (::ioctl(chip, GPIO_V2_GET_LINE_IOCTL, &request) == 0) descriptor_ = request.fd;
    ::close(chip);
  }
  ~OutputLine() { ::close(descriptor_); }
  OutputLine(const OutputLine&) = delete;
  OutputLine& operator=(const OutputLine&) = delete;

  bool set(bool high) {
    gpio_v2_line_values values{high ? 1u : 0u, 1u};
    return ::ioctl(descriptor_, GPIO_V2_LINE_SET_VALUES_IOCTL, &values) == 0;
  }

 private:
  int descriptor_ = -1;
};

TEST(LabInstruments, TraceHoldsEveryPulseOfTheLineAndNoOther) {
  GpioSim chip("instruments", {"other", "pulsed"});
  OutputLine other(chip.device_path(), 0);
  OutputLine pulsed(chip.device_path(), 1);
  KernelTrace trace("gpio/gpio_value");
  for (int i = 0; i < 1000; ++i) {
    ASSERT_TRUE(pulsed.set(true));
    ASSERT_TRUE(pulsed.set(false));
    ASSERT_TRUE(other.set(i % 2 == 0));
  }
  const std::vector<TraceEvent> events = trace.events();
  EXPECT_EQ(rising_edges(events, chip.global_number("pulsed")).size(), 1000u);
  EXPECT_EQ(rising_edges(events, chip.global_number("other")).size(), 500u);
}

TEST(LabInstruments, TraceKeepsTheOrderOfMarksAndEdgesAndTheMonotonicClock) {
  GpioSim chip("instruments", {"line"});
  OutputLine line(chip.device_path(), 0);
  KernelTrace trace("gpio/gpio_value");
  const Instant before = SystemClock().now();
  trace.mark("before");
  ASSERT_TRUE(line.set(true));
  trace.mark("after");
  const Instant after = SystemClock().now();

  const std::vector<TraceEvent> events = trace.events();
  const std::vector<Instant> edges = rising_edges(events, chip.global_number("line"));
  ASSERT_EQ(edges.size(), 1u);
  const auto microsecond = std::chrono::microseconds(1);  // the record's resolution
  EXPECT_GE(time_of_mark(events, "before"), before - microsecond);
  EXPECT_LE(time_of_mark(events, "before"), edges[0]);
  EXPECT_LE(edges[0], time_of_mark(events, "after"));
  EXPECT_LE(time_of_mark(events, "after"), after + microsecond);
}

TEST(LabInstruments, LevelsGoBothWaysAndAChipCanBeTakenAway) {
  GpioSim chip("instruments", {"line"});
  {
    OutputLine line(chip.device_path(), 0);
    ASSERT_TRUE(line.set(true));
    EXPECT_TRUE(chip.level("line"));
    chip.remove();
    EXPECT_FALSE(line.set(false));
  }
  EXPECT_EQ(::access(chip.device_path().c_str(), F_OK), -1);
}

}  // namespace
}  // namespace skullstation
