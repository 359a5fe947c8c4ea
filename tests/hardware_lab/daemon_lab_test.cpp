// The installed station under its own unit: systemd, udev, a GPIO chip and a camera of a real
// kernel. Nothing but wires goes in; lamps, files and what systemd and the kernel say come out.

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <thread>

#include "core/file.h"
#include "tests/hardware_lab/gpio_sim_world.h"
#include "tests/hardware_lab/kernel_file.h"
#include "tests/hardware_lab/vivid_device.h"
#include "tests/hardware_lab/wired_table.h"
#include "tests/support/process.h"
#include "tests/support/station_client.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using nlohmann::json;
using skullstation::testing::comes_true;
using ::testing::HasSubstr;

constexpr int views = 6;
constexpr double steps_per_turn = 200.0;
const fs::path storage = "/var/lib/skullstation";

/// A station of twelve lines and one camera, with a table that the emulated machine can follow. The
/// camera shows colour bars: no gate for photographs of skulls would let them pass.
std::string configuration() {
  return fmt::format(
      R"([station]
id = "LAB"
backend = "gpio"
camera_check_s = 1

[turntable]
steps_per_turn = {}
max_speed_deg_s = 60
max_acceleration_deg_s2 = 240
max_jerk_deg_s3 = 2000
home_speed_deg_s = 30
backlash_deg = 3.6

[gpio]
debounce_ms = 60
[gpio.home]
bias = "as_wired"
[gpio.estop]
bias = "as_wired"
[gpio.button]
bias = "as_wired"

[[camera]]
id = "bars"
backend = "v4l2"
device = "{}"
width = 640
height = 360
format = "YUYV"

[scan]
passes = 1
views_per_ring = {}
settle_ms = 100
frame_timeout_ms = 30000

[gates]
min_board_corners = 0
max_border_percent = 100
max_clipped_percent = 100
max_dark_percent = 100
min_mean_level = 0
max_mean_level = 255
min_specimen_percent = 0
max_motion_px = 100
min_sharpness = 0
min_sharpness_of_median = 0
)",
      steps_per_turn, VividDevice::stable_path(), views);
}

skullstation::testing::ProcessResult systemctl(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "/usr/bin/systemctl");
  return skullstation::testing::Process(arguments).wait();
}

class DaemonLab : public ::testing::Test {
 protected:
  void SetUp() override {
    camera_.show_colour_bars();
    fs::create_directories("/etc/skullstation");
    ASSERT_TRUE(write_file_durably("/etc/skullstation/station.toml", configuration()));
    systemctl({"clean", "--what=state", "skullstationd.service"});
    systemctl({"reset-failed", "skullstationd.service"});
    const auto started = systemctl({"start", "skullstationd.service"});
    ASSERT_EQ(started.exit_code, 0) << started.err;
    ASSERT_TRUE(becomes("ready"));
  }
  void TearDown() override {
    if (HasFailure()) {
      const auto log = skullstation::testing::Process(
                           {"/usr/bin/journalctl", "--no-pager", "-u", "skullstationd.service"})
                           .wait();
      std::cerr << log.out;
    }
    EXPECT_EQ(systemctl({"stop", "skullstationd.service"}).exit_code, 0);
    EXPECT_EQ(property("Result"), "success");
  }

  /// What systemd says of the daemon.
  static std::string property(const std::string& name) {
    auto shown = systemctl({"show", "--value", "-p", name, "skullstationd.service"}).out;
    if (shown.ends_with('\n')) shown.pop_back();
    return shown;
  }
  static fs::path process() { return fs::path("/proc") / property("MainPID"); }

  static json ask(const std::string& line) {
    return skullstation::testing::ask_station(storage / "control", line);
  }
  static std::string said(const std::string& key) {
    const json status = ask("status");
    return status.is_object() ? status.value(key, "") : "";
  }
  static bool becomes(const std::string& state) {
    const bool became = comes_true([&] { return said("state") == state; }, 120s);
    if (!became) ADD_FAILURE() << "still " << ask("status").dump() << ", not " << state;
    return became;
  }
  static double scanned() {
    const json status = ask("status");
    return status.is_object() && status.contains("scan") ? status["scan"].value("fraction", 0.0)
                                                         : 0.0;
  }
  /// Presses, and waits until some of the views are there and the platter turns to the next.
  void scan_some() {
    table_.press_button();
    ASSERT_TRUE(becomes("scanning"));
    ASSERT_TRUE(comes_true([] { return scanned() > 0.3; }, 120s));
    const long before = table_.steps_made();
    ASSERT_TRUE(comes_true([&] { return table_.steps_made() > before; }));
  }
  /// The lamps until somebody presses: yellow comes and goes, nothing else is lit.
  bool asks_for_attention() {
    return becomes("turn-over") && comes_true([&] { return table_.yellow(); }) &&
           comes_true([&] { return !table_.yellow(); }) && !table_.green() && !table_.red();
  }
  /// Whatever became of its steps.
  static bool scan_is_saved() {
    return comes_true(
        [] {
          const json answer = ask("cases");
          return answer.is_object() && answer["cases"][0]["state"] != "scanning";
        },
        120s);
  }
  /// As the store has them: pictures of the case, all of whose session is there.
  static std::size_t pictures_of_first_case() {
    const json jobs = ask("jobs 1");
    for (const json& row : jobs["jobs"]) {
      if (row["step"] != "scan") continue;
      const json answer = ask(fmt::format("files {}", row["id"].get<int>()));
      std::size_t pictures = 0;
      for (const json& file : answer["files"]) {
        const auto bytes = read_file(file["blob"].get<std::string>());
        if (!bytes) ADD_FAILURE() << bytes.error().message();
        if (file["path"].get<std::string>().starts_with("images/")) ++pictures;
        if (file["path"] == "session.json" && bytes) {
          const json session = json::parse(*bytes);
          EXPECT_EQ(session["complete"], true);
          EXPECT_EQ(session["views"].size(), static_cast<std::size_t>(views));
        }
      }
      return pictures;
    }
    return 0;
  }

  std::unique_ptr<GpioSim> chip_ = make_gpio_sim_station();
  VividDevice camera_;
  WiredTable table_{*chip_, steps_per_turn};
};

TEST_F(DaemonLab, RunsUnderItsUnitAsItsOwnUserWithoutPrivileges) {
  EXPECT_EQ(property("ActiveState"), "active");
  EXPECT_EQ(property("User"), "skullstation");
  const std::string status = read_kernel_file(process() / "status");
  EXPECT_THAT(status, HasSubstr("CapEff:\t0000000000000000"));
  EXPECT_THAT(status, HasSubstr("CapBnd:\t0000000000000000"));
  EXPECT_THAT(status, HasSubstr("NoNewPrivs:\t1"));
  EXPECT_THAT(status, HasSubstr("Seccomp:\t2"));
  EXPECT_TRUE(table_.green());
  EXPECT_FALSE(table_.yellow());
  EXPECT_FALSE(table_.red());
  EXPECT_FALSE(table_.current_on()) << "nobody has pressed the button";
  EXPECT_EQ(table_.steps_made(), 0);
  EXPECT_EQ(fs::status(storage).permissions() & fs::perms::others_all, fs::perms::none);
}

TEST_F(DaemonLab, AnEdgeOfTheButtonBecomesASavedScan) {
  table_.press_button();
  ASSERT_TRUE(comes_true([&] { return table_.yellow() && !table_.green(); }));
  ASSERT_TRUE(comes_true([&] { return table_.current_on() && table_.steps_made() > 0; }));
  // The motor's thread is on time: SCHED_FIFO, which the unit has to allow.
  const auto in_real_time = [] {
    for (const auto& task : fs::directory_iterator(process() / "task")) {
      const std::string stat = read_kernel_file(task.path() / "stat");
      // proc(5): fields 40 and 41 of the whole, counted from behind the name's bracket.
      std::istringstream fields(stat.substr(stat.rfind(')') + 2));
      std::string field;
      for (int i = 3; i <= 40; ++i) fields >> field;
      if (std::stoi(field) > 0) return true;
    }
    return false;
  };
  EXPECT_TRUE(comes_true(in_real_time)) << "no thread has a real-time priority";
  ASSERT_TRUE(scan_is_saved());
  ASSERT_TRUE(comes_true([&] { return table_.green(); })) << "the pictures are safe";
  EXPECT_EQ(pictures_of_first_case(), static_cast<std::size_t>(views));
  EXPECT_TRUE(comes_true([&] { return !table_.current_on(); })) << "after the scan";
}

TEST_F(DaemonLab, TheEmergencyStopLatches) {
  scan_some();
  table_.press_stop();
  ASSERT_TRUE(becomes("fault"));
  EXPECT_FALSE(table_.current_on());
  ASSERT_TRUE(comes_true([&] { return table_.red() && !table_.yellow() && !table_.green(); }));
  EXPECT_THAT(said("message"), HasSubstr("emergency stop"));
  const long steps = table_.steps_made();

  table_.press_button();  // the stop is still in
  ASSERT_TRUE(
      comes_true([] { return said("message").find("can't be reset") != std::string::npos; }));
  ASSERT_TRUE(becomes("fault"));
  table_.release_stop();
  std::this_thread::sleep_for(3s);
  EXPECT_EQ(said("state"), "fault") << "it must not start by itself";
  EXPECT_TRUE(table_.red());
  EXPECT_FALSE(table_.current_on());
  EXPECT_EQ(table_.steps_made(), steps);

  table_.press_button();
  ASSERT_TRUE(asks_for_attention());
  EXPECT_EQ(table_.steps_made(), steps) << "before the specimen is confirmed";
  table_.press_button();
  ASSERT_TRUE(scan_is_saved());
  EXPECT_EQ(pictures_of_first_case(), static_cast<std::size_t>(views));
}

TEST_F(DaemonLab, AnUnpluggedCameraIsToldOfAndComesBack) {
  camera_.unplug();
  ASSERT_TRUE(becomes("fault"));
  EXPECT_THAT(said("message"), HasSubstr("camera \"bars\""));
  ASSERT_TRUE(comes_true([&] { return table_.red(); }));
  camera_.plug();
  ASSERT_TRUE(becomes("ready"));
  ASSERT_TRUE(comes_true([&] { return table_.green() && !table_.red(); }));
}

TEST_F(DaemonLab, ACameraUnpluggedInTheMiddleOfAScanCostsNoPicture) {
  scan_some();
  camera_.unplug();
  ASSERT_TRUE(becomes("fault"));
  EXPECT_THAT(said("message"), HasSubstr("camera \"bars\""));
  camera_.plug();
  table_.press_button();
  ASSERT_TRUE(asks_for_attention());
  table_.press_button();
  ASSERT_TRUE(scan_is_saved());
  EXPECT_EQ(pictures_of_first_case(), static_cast<std::size_t>(views));
}

TEST_F(DaemonLab, TheWatchdogRestartsADaemonThatHangsAndTheScanGoesOn) {
  scan_some();
  const std::string hung = property("MainPID");
  ASSERT_EQ(::kill(std::stoi(hung), SIGSTOP), 0);
  ASSERT_TRUE(comes_true([] { return property("NRestarts") == "1"; }, 120s));
  ASSERT_TRUE(asks_for_attention());
  EXPECT_NE(property("MainPID"), hung);
  const auto log = skullstation::testing::Process(
                       {"/usr/bin/journalctl", "--no-pager", "-u", "skullstationd.service"})
                       .wait();
  EXPECT_THAT(log.out, HasSubstr("Watchdog timeout"));
  table_.press_button();
  ASSERT_TRUE(scan_is_saved());
  EXPECT_EQ(pictures_of_first_case(), static_cast<std::size_t>(views));
}

}  // namespace
}  // namespace skullstation
