// Exit codes, JSON, help, and one clear error for each mistake that a user can make.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mount.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/session.h"
#include "tests/e2e/small_station.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::ProcessResult;
using skullstation::testing::skullstation_cli;
using skullstation::testing::SmallStation;
using skullstation::testing::TemporaryFolder;
using skullstation::testing::write_small_station;
using ::testing::HasSubstr;
using ::testing::Not;

class CommandLine : public ::testing::Test {
 protected:
  ProcessResult scan(const SmallStation& station) {
    const auto config = write_small_station(folder_.path(), station);
    return scan_with(config);
  }
  ProcessResult scan_with(const std::filesystem::path& config) {
    return skullstation_cli(
        {"scan", "--config", config.string(), "--out", (folder_ / "session").string()});
  }
  std::size_t recorded() {
    const auto session = read_session(folder_ / "session");
    EXPECT_TRUE(session) << session.error().message();
    if (!session) return 0;
    EXPECT_TRUE(verify_images(*session, folder_ / "session"));
    return session->views.size();
  }

  TemporaryFolder folder_;
};

TEST_F(CommandLine, HelpAndVersionSucceedAndNonsenseIsUsage) {
  EXPECT_EQ(skullstation_cli({"--help"}).exit_code, 0);
  EXPECT_EQ(skullstation_cli({"scan", "--help"}).exit_code, 0);
  EXPECT_THAT(skullstation_cli({"--version"}).out, HasSubstr("."));
  EXPECT_EQ(skullstation_cli({}).exit_code, 2);
  EXPECT_EQ(skullstation_cli({"scna"}).exit_code, 2);
  EXPECT_EQ(skullstation_cli({"scan"}).exit_code, 2);
  EXPECT_EQ(skullstation_cli({"scan", "--out", "x", "--threads", "many"}).exit_code, 2);
}

TEST_F(CommandLine, AScanReportsItsFiguresAsJson) {
  const auto config = write_small_station(folder_.path());
  const auto result = skullstation_cli(
      {"scan", "--json", "--config", config.string(), "--out", (folder_ / "session").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["planned"], 16);
  EXPECT_EQ(json["taken"], 16);
  EXPECT_EQ(recorded(), 16U);
}

TEST_F(CommandLine, TheSameSeedGivesTheSameBytesForAnyNumberOfThreads) {
  const auto config = write_small_station(folder_.path());
  for (const char* threads : {"1", "2"}) {
    const auto result = skullstation_cli(
        {"scan", "--threads", threads, "--config", config.string(), "--out", folder_ / threads});
    ASSERT_EQ(result.exit_code, 0) << result.err;
  }
  EXPECT_EQ(read_file(folder_ / "1/session.json").value(),
            read_file(folder_ / "2/session.json").value());
}

TEST_F(CommandLine, AMissingConfigurationIsNamed) {
  const auto result = scan_with(folder_ / "none.toml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("none.toml: can't be read (No such file or directory)"));
}

TEST_F(CommandLine, MalformedTomlIsNamedWithItsLine) {
  ASSERT_TRUE(write_file_durably(folder_ / "s.toml", "[station]\nid = \n"));
  const auto result = scan_with(folder_ / "s.toml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("s.toml:2: not valid TOML"));
}

TEST_F(CommandLine, AnUnknownKeyIsNamedWithItsLineAndASuggestion) {
  ASSERT_TRUE(write_file_durably(folder_ / "s.toml", "[turntable]\nbacklash = 1\n"));
  const auto result = scan_with(folder_ / "s.toml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("s.toml:2: unknown key \"turntable.backlash\"; did you mean "
                                    "\"backlash_deg\"?"));
}

TEST_F(CommandLine, AnImpossibleValueIsNamedWithItsLine) {
  ASSERT_TRUE(write_file_durably(folder_ / "s.toml", "[scan]\npasses = 9\n"));
  const auto result = scan_with(folder_ / "s.toml");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("s.toml:2: scan.passes must be 1 to 3"));
}

TEST_F(CommandLine, ConfigCheckListsEveryMistake) {
  ASSERT_TRUE(write_file_durably(folder_ / "s.toml",
                                 "[scan]\npasses = 9\npassez = 1\n[board]\nsquare_mm = \"25\"\n"));
  const auto result = skullstation_cli({"config", "check", (folder_ / "s.toml").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.out, HasSubstr("s.toml:3: unknown key \"scan.passez\""));
  EXPECT_THAT(result.out, HasSubstr("s.toml:5: board.square_mm must be a number, found text"));
  EXPECT_THAT(result.out, HasSubstr("s.toml:2: scan.passes must be 1 to 3"));
}

TEST_F(CommandLine, ConfigShowIsAConfigurationItself) {
  const auto shown = skullstation_cli({"config", "show"});
  ASSERT_EQ(shown.exit_code, 0) << shown.err;
  ASSERT_TRUE(write_file_durably(folder_ / "shown.toml", shown.out));
  const auto checked = skullstation_cli({"config", "check", (folder_ / "shown.toml").string()});
  EXPECT_EQ(checked.exit_code, 0) << checked.out;
}

TEST_F(CommandLine, AMissingCameraIsNamed) {
  ASSERT_TRUE(write_file_durably(
      folder_ / "s.toml",
      "[[camera]]\nid = \"left\"\nbackend = \"v4l2\"\ndevice = \"/dev/video99\"\n"));
  const auto result = scan_with(folder_ / "s.toml");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("camera \"left\""));
  EXPECT_THAT(result.err, HasSubstr("/dev/video99"));
}

TEST_F(CommandLine, MissingGpioIsNamed) {
  ASSERT_TRUE(write_file_durably(folder_ / "s.toml",
                                 "[station]\nbackend = \"gpio\"\n[[camera]]\nbackend = \"v4l2\"\n"
                                 "device = \"/dev/video99\"\n"));
  const auto result = scan_with(folder_ / "s.toml");
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("gpio"));
}

TEST_F(CommandLine, AFolderThatCantBeWrittenIsNamed) {
  const auto config = write_small_station(folder_.path());
  const auto result =
      skullstation_cli({"scan", "--config", config.string(), "--out", "/proc/session"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("/proc/session"));
}

TEST_F(CommandLine, AFullDiskIsNoticedBeforeTheFirstMove) {
  const auto disk = folder_ / "disk";
  std::filesystem::create_directories(disk);
  if (::mount("tmpfs", disk.c_str(), "tmpfs", 0, "size=256k") != 0) {
    GTEST_SKIP() << "may not mount a small disk here; the unit tests of capture/scan cover it";
  }
  const auto config = write_small_station(folder_.path());
  const auto result =
      skullstation_cli({"scan", "--config", config.string(), "--out", (disk / "s").string()});
  ::umount(disk.c_str());
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("space"));
}

TEST_F(CommandLine, AnUnpluggedCameraStopsTheScanAndLosesNothing) {
  SmallStation station;
  station.views_per_ring = 12;
  station.camera = "unplugged_after_frames = 34\n";  // two frames a view: at view 17
  const auto result = scan(station);
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("cam0"));
  EXPECT_THAT(result.err, HasSubstr("unplugged"));
  EXPECT_GE(recorded(), 30U);
  station.camera = "";
  EXPECT_EQ(scan(station).exit_code, 0);
  EXPECT_EQ(recorded(), 48U);
}

TEST_F(CommandLine, TheEmergencyStopStopsTheScanAndLosesNothing) {
  SmallStation station;
  station.simulation = "estop_after_turn_deg = 560\n";
  const auto result = scan(station);
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("emergency stop"));
  const std::size_t before = recorded();
  EXPECT_GT(before, 0U);
  EXPECT_LT(before, 16U);
  station.simulation = "";
  EXPECT_EQ(scan(station).exit_code, 0);
  EXPECT_EQ(recorded(), 16U);
}

TEST_F(CommandLine, AMissingIndexSwitchIsNamed) {
  SmallStation station;
  station.simulation = "index_switch_missing = true\n";
  const auto result = scan(station);
  EXPECT_EQ(result.exit_code, 4);
  EXPECT_THAT(result.err, HasSubstr("index switch"));
}

TEST_F(CommandLine, ASpecimenThatIsNoMeshIsNamed) {
  SmallStation station;
  const auto config = write_small_station(folder_.path(), station);
  ASSERT_TRUE(write_file_durably(folder_ / "specimen.ply", "not a mesh\n"));
  const auto result = scan_with(config);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("specimen.ply:line 1: not a PLY file"));
}

TEST_F(CommandLine, ASessionOfAnotherPlanIsNotMixedUp) {
  SmallStation station;
  ASSERT_EQ(scan(station).exit_code, 0);
  station.views_per_ring = 6;
  const auto result = scan(station);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_EQ(recorded(), 16U);
}

TEST_F(CommandLine, ADamagedImageIsNamedByTheCheckAndTakenAgainByTheScan) {
  SmallStation station;
  station.passes = 1;
  ASSERT_EQ(scan(station).exit_code, 0);
  const auto image = folder_ / "session/images/p0_c0_001.png";
  std::string bytes = *read_file(image);
  bytes[bytes.size() / 2] ^= 1;
  ASSERT_TRUE(write_file_durably(image, bytes));
  const auto check = skullstation_cli({"session", "check", (folder_ / "session").string()});
  EXPECT_EQ(check.exit_code, 3);
  EXPECT_THAT(check.err, HasSubstr("p0_c0_001.png"));
  EXPECT_EQ(scan(station).exit_code, 0);
  EXPECT_EQ(recorded(), 8U);
}

TEST_F(CommandLine, AnErrorIsAnObjectToo) {
  const auto result = skullstation_cli(
      {"scan", "--json", "--config", (folder_ / "none.toml").string(), "--out", "x"});
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["error"]["kind"], "bad input");
  EXPECT_THAT(json["error"]["where"].get<std::string>(), HasSubstr("none.toml"));
}

TEST_F(CommandLine, ACancelledScanSaysSoAndGoesOnLater) {
  SmallStation station;
  station.views_per_ring = 200;
  const auto config = write_small_station(folder_.path(), station);
  skullstation::testing::Process process({skullstation::testing::skullstation_program().string(),
                                          "scan", "--config", config.string(), "--out",
                                          (folder_ / "session").string()});
  // The second picture is written after the first was recorded.
  while (!std::filesystem::exists(folder_ / "session/images/p0_c1_000.png")) {
    ASSERT_FALSE(process.wait_for(std::chrono::milliseconds(10)));
  }
  process.send(SIGINT);
  const auto result = process.wait();
  EXPECT_EQ(result.exit_code, 130);
  EXPECT_THAT(result.err, HasSubstr("stopped"));
  EXPECT_GT(recorded(), 0U);
}

TEST_F(CommandLine, TheBoardIsWrittenAtItsTrueSize) {
  const auto result = skullstation_cli({"calibrate", "board", "--out", folder_ / "board.svg"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(*read_file(folder_ / "board.svg"), HasSubstr("width=\"350mm\" height=\"350mm\""));
}

TEST_F(CommandLine, TheDoctorNamesWhatIsWrong) {
  SmallStation station;
  const auto config = write_small_station(folder_.path(), station);
  const auto well = skullstation_cli({"doctor", "--config", config.string()});
  EXPECT_EQ(well.exit_code, 0) << well.out;
  EXPECT_THAT(well.out, HasSubstr("is not calibrated"));
  station.camera = "dead = true\n";
  write_small_station(folder_.path(), station);
  const auto ill = skullstation_cli({"doctor", "--config", config.string()});
  EXPECT_EQ(ill.exit_code, 4);
  EXPECT_THAT(ill.out, HasSubstr("[ FAIL ]"));
  EXPECT_THAT(ill.out, HasSubstr("cam0"));
}

}  // namespace
}  // namespace skullstation
