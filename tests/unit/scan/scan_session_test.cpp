#include "capture/scan/scan_session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>

#include "capture/scan/space_reserve.h"
#include "core/session/image_file.h"
#include "core/session/session.h"
#include "core/units.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/scan/test_bench.h"

namespace skullstation {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using testing::files_in;
using testing::good_picture;
using ::testing::HasSubstr;
using testing::TemporaryFolder;
using testing::TestBench;

void expect_at_rest(const TestBench& bench) {
  EXPECT_FALSE(bench.motor_is_on());
  EXPECT_FALSE(bench.station.lights_on());
}

/// What any interruption must leave: a readable session whose images are all there.
Session expect_valid_session(const std::filesystem::path& folder) {
  const Result<Session> session = read_session(folder);
  if (!session) {
    ADD_FAILURE() << session.error().message();
    return {};
  }
  const Result<void> intact = verify_images(*session, folder);
  EXPECT_TRUE(intact) << intact.error().message();
  EXPECT_FALSE(std::filesystem::exists(folder / SpaceReserve::file_name));
  return *session;
}

TEST(RunScan, LeavesACompleteSession) {
  const TemporaryFolder folder;
  TestBench bench;
  bool lit_and_powered = true;
  bench.camera0.on_request = [&](int request) {
    lit_and_powered &= bench.station.lights_on();
    if (request > 1) lit_and_powered &= bench.station.motor_current_on();
  };
  bool off_for_hands = false;
  bench.on_placement = [&](const PlacementRequest&) {
    off_for_hands = !bench.station.motor_current_on();
  };
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->planned, 12);
  EXPECT_EQ(report->taken, 12);
  EXPECT_EQ(report->kept, 0);
  EXPECT_EQ(report->retries, 0);
  EXPECT_THAT(report->rejected, ElementsAre());
  EXPECT_TRUE(lit_and_powered);
  EXPECT_TRUE(off_for_hands);
  expect_at_rest(bench);

  ASSERT_EQ(bench.placements.size(), 1U);
  EXPECT_EQ(bench.placements[0].pass, 1);
  EXPECT_FALSE(bench.placements[0].continued);

  const Session session = expect_valid_session(folder / "s");
  EXPECT_EQ(session.complete, true);
  EXPECT_EQ(session.station, "ST-01");
  EXPECT_EQ(session.case_number, "2026-0042");
  EXPECT_EQ(session.plan, bench.options.plan.record());
  EXPECT_FALSE(session.board);
  ASSERT_EQ(session.cameras.size(), 2U);
  EXPECT_EQ(session.cameras[0].width, 96);
  EXPECT_EQ(session.cameras[0].height, 72);
  EXPECT_EQ(session.cameras[0].params, std::nullopt);
  ASSERT_EQ(session.views.size(), 12U);
  for (const SessionView& view : session.views) {
    ASSERT_TRUE(view.quality);
    EXPECT_EQ(view.quality->attempts, 1);
    EXPECT_FALSE(view.quality->rejected) << *view.quality->rejected;
    EXPECT_GT(view.quality->sharpness, 0.0);
    EXPECT_GT(view.quality->specimen_percent, 10.0);
    EXPECT_EQ(view.exposure, std::chrono::microseconds(8000));
    ASSERT_TRUE(view.captured);
    EXPECT_TRUE(view.captured->starts_with("2026-01-01T"));
    EXPECT_EQ(read_image(folder / "s" / view.image)->width, 96);
  }
  std::set<std::string> expected{"session.json"};
  for (const PlannedView& view : planned_views(bench.options.plan)) expected.insert(view.image);
  EXPECT_EQ(files_in(folder / "s"), expected);
}

TEST(RunScan, EachPictureIsOfATableAtRestAtItsAngle) {
  const TemporaryFolder folder;
  TestBench bench;
  ASSERT_TRUE(bench.scan(folder / "s"));
  const Session session = expect_valid_session(folder / "s");
  // After the look-through, two frames a view; the second is the recorded one.
  std::size_t taken0 = 2;
  std::size_t taken1 = 2;
  for (const SessionView& view : session.views) {
    const bool first_camera = view.camera == "cam0";
    const testing::FakeCamera& camera = first_camera ? bench.camera0 : bench.camera1;
    std::size_t& frame = first_camera ? taken0 : taken1;
    const Instant exposed = camera.exposures.at(frame);
    EXPECT_GE(exposed - camera.exposures.at(frame - 1), bench.options.motion_interval);
    const double truth = bench.station.true_table_angle_deg(exposed);
    EXPECT_LT(std::abs(turn_deg(truth, *view.table_angle_deg)), 0.05) << view.image;
    // At rest for the whole time since it settled.
    EXPECT_NEAR(bench.station.true_table_angle_deg(exposed - std::chrono::milliseconds(100)), truth,
                0.02);
    frame += 2;
  }
}

TEST(RunScan, CalibratedLensesAndABoardGoIntoTheSession) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.lens = Lens{96, 72, 120.0, 121.0, 48.5, 36.5, -0.1, 0.01, 1e-4, 2e-4};
  bench.options.board = CharucoBoard{};
  bench.options.max_attempts = 1;
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->rejected.size(), 12U);
  EXPECT_THAT(report->rejected[0], HasSubstr("board not visible: 0 corners seen, 12 are needed"));
  const Session session = expect_valid_session(folder / "s");
  EXPECT_EQ(session.board, bench.options.board);
  EXPECT_EQ(session.cameras[1].params, bench.lens->params(LensModel::opencv));
  EXPECT_EQ(session.cameras[1].model, LensModel::opencv);
}

TEST(RunScan, JpegsAreWrittenOnRequest) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.options.plan.image_format = PhotographFormat::jpeg;
  ASSERT_TRUE(bench.scan(folder / "s"));
  const Session session = expect_valid_session(folder / "s");
  EXPECT_EQ(session.views[0].image, "images/p0_c0_000.jpg");
  EXPECT_TRUE(read_image(folder / "s" / session.views[0].image));
}

TEST(RunScan, ReportsWhereItIs) {
  const TemporaryFolder folder;
  TestBench bench;
  ASSERT_TRUE(bench.scan(folder / "s"));
  EXPECT_THAT(bench.stages, Contains("pass 1 of 2, view 3 of 6"));
  EXPECT_THAT(bench.stages, Contains("pass 2 of 2, view 6 of 6"));
  EXPECT_TRUE(std::ranges::is_sorted(bench.fractions));
  EXPECT_EQ(bench.fractions.back(), 1.0);
}

// ---- gates and retries ----

TEST(RunScan, ABadViewIsTakenAgainAfterALongerRest) {
  const TemporaryFolder folder;
  TestBench bench;
  // Requests 2 and 3 are the first view's frames; they are overexposed.
  bench.camera0.picture = [](int request) {
    return request == 2 || request == 3 ? Image8(96, 72, 1, 255)
                                        : good_picture(96, 72, static_cast<std::uint64_t>(request));
  };
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->retries, 1);
  EXPECT_THAT(report->rejected, ElementsAre());
  const Session session = expect_valid_session(folder / "s");
  EXPECT_EQ(session.views[0].quality->attempts, 2);
  EXPECT_EQ(session.views[1].quality->attempts, 1);
  EXPECT_GE(bench.camera0.exposures.at(3) - bench.camera0.exposures.at(2),
            2 * bench.options.settle_time);
}

TEST(RunScan, AViewThatStaysBadIsRecordedWithItsReason) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.camera1.picture = [](int) { return Image8(96, 72, 1, 10); };
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->taken, 12);
  EXPECT_EQ(report->rejected.size(), 4U);
  EXPECT_THAT(report->rejected[0], HasSubstr("images/p0_c1_000.png: no specimen seen"));
  const Session session = expect_valid_session(folder / "s");
  EXPECT_EQ(session.complete, true);
  for (const SessionView& view : session.views) {
    EXPECT_EQ(view.quality->attempts, view.camera == "cam1" ? 3 : 1);
    EXPECT_EQ(view.quality->rejected.has_value(), view.camera == "cam1");
  }
}

// ---- devices that fail ----

TEST(RunScan, ACameraThatComesBackIsUsedOn) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.camera0.unplugged_at = {4};
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(bench.camera0.reopened, 1);
  EXPECT_EQ(report->taken, 12);
}

TEST(RunScan, ACameraThatStaysAwayEndsTheScan) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.camera0.unplugged_at = {6};
  bench.camera0.can_be_reopened = false;
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::hardware);
  EXPECT_THAT(
      report.error().message(),
      HasSubstr("camera \"cam0\", fake camera: was unplugged; 3 of 12 views are recorded: the "
                "same scan started again"));
  EXPECT_EQ(bench.camera0.reopened, 1);
  expect_at_rest(bench);
  EXPECT_EQ(expect_valid_session(folder / "s").views.size(), 3U);
}

TEST(RunScan, ADeadCameraIsNoticedBeforeAnythingMoves) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.camera1.unplugged_at = {1};
  bench.camera1.can_be_reopened = false;
  const double angle_deg = bench.station.true_table_angle_deg(bench.clock.now());
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::hardware);
  EXPECT_EQ(bench.station.true_table_angle_deg(bench.clock.now()), angle_deg);
  expect_at_rest(bench);
}

TEST(RunScan, ACameraThatChangesItsFormatEndsTheScan) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.camera0.picture = [](int request) { return good_picture(request < 4 ? 96 : 48, 72, 1); };
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::hardware);
  EXPECT_THAT(report.error().message(), HasSubstr("changed its format during the scan: 48x72"));
  expect_valid_session(folder / "s");
}

TEST(RunScan, ALensOfAnotherFormatIsRefused) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.lens = Lens{640, 480, 500.0, 500.0, 320.0, 240.0};
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(report.error().message(),
              HasSubstr("cam0: was calibrated at 640x480 px and delivers 96x72"));
  expect_at_rest(bench);
}

TEST(RunScan, AMissingIndexSwitchEndsTheScan) {
  const TemporaryFolder folder;
  SimulatedFaults faults;
  faults.index_switch_missing = true;
  TestBench bench(faults);
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::hardware);
  EXPECT_THAT(report.error().message(), HasSubstr("index switch never seen"));
  expect_at_rest(bench);
  expect_valid_session(folder / "s");
}

TEST(RunScan, TheEmergencyStopMidMoveEndsTheScanAndLosesNothing) {
  const TemporaryFolder folder;
  std::set<std::size_t> recorded;
  for (const double turn_deg : {5.0, 200.0, 460.0, 640.0, 900.0}) {
    const std::filesystem::path session = folder / std::to_string(turn_deg);
    SimulatedFaults faults;
    faults.estop_after_turn_deg = turn_deg;
    TestBench bench(faults);
    const Result<ScanReport> report = bench.scan(session);
    if (report) continue;  // the scan was over before
    EXPECT_EQ(report.error().kind, ErrorKind::hardware);
    EXPECT_THAT(report.error().message(), HasSubstr("emergency stop pressed"));
    expect_at_rest(bench);
    recorded.insert(expect_valid_session(session).views.size());

    bench.station.release_estop();
    ASSERT_TRUE(bench.hardware.interlock->reset());
    const Result<ScanReport> resumed = bench.scan(session);
    ASSERT_TRUE(resumed) << resumed.error().message();
    EXPECT_EQ(resumed->taken + resumed->kept, 12);
    EXPECT_EQ(expect_valid_session(session).complete, true);
  }
  EXPECT_GT(recorded.size(), 2U) << "the stop was always hit at the same place";
}

TEST(RunScan, TheEmergencyStopDuringAPictureOrATurnOverEndsTheScan) {
  for (const bool during_placement : {false, true}) {
    const TemporaryFolder folder;
    TestBench bench;
    if (during_placement) {
      bench.on_placement = [&](const PlacementRequest&) { bench.station.press_estop(); };
    } else {
      bench.camera0.on_request = [&](int request) {
        if (request == 5) bench.station.press_estop();
      };
    }
    const Result<ScanReport> report = bench.scan(folder / "s");
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().kind, ErrorKind::hardware);
    EXPECT_THAT(report.error().message(), HasSubstr("emergency stop pressed"));
    expect_at_rest(bench);
    EXPECT_EQ(expect_valid_session(folder / "s").views.size(), during_placement ? 6U : 2U);
  }
}

TEST(RunScan, ATrippedInterlockIsNoticedAtOnce) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.station.press_estop();
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), HasSubstr("emergency stop pressed"));
  EXPECT_EQ(bench.camera0.requests, 0);
}

TEST(RunScan, CancelledAnywhereItEndsAtRest) {
  for (int at_report = 1; at_report < 18; ++at_report) {
    const TemporaryFolder folder;
    TestBench bench;
    bench.use_instant_turntable();
    std::stop_source stop;
    Progress progress;
    progress.stop = stop.get_token();
    int reports = 0;
    progress.report = [&](double, std::string_view) {
      if (++reports == at_report) stop.request_stop();
    };
    const Result<ScanReport> report = bench.scan(folder / "s", progress);
    if (report) continue;  // the last report is that of the end
    EXPECT_EQ(report.error().kind, ErrorKind::cancelled) << report.error().message();
    expect_at_rest(bench);
    if (std::filesystem::exists(folder / "s/session.json")) expect_valid_session(folder / "s");
    const Result<ScanReport> resumed = bench.scan(folder / "s");
    ASSERT_TRUE(resumed) << resumed.error().message();
    EXPECT_EQ(expect_valid_session(folder / "s").views.size(), 12U);
  }
}

TEST(RunScan, ARefusedPlacementEndsTheScan) {
  const TemporaryFolder folder;
  TestBench bench;
  std::stop_source stop;
  Progress progress;
  progress.stop = stop.get_token();
  bench.on_placement = [&](const PlacementRequest&) { stop.request_stop(); };
  const Result<ScanReport> report = bench.scan(folder / "s", progress);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::cancelled);
  expect_at_rest(bench);
  EXPECT_EQ(expect_valid_session(folder / "s").views.size(), 6U);
}

// ---- disk ----

TEST(RunScan, AFullDiskIsNoticedBeforeAnythingMoves) {
  const TemporaryFolder folder;
  TestBench bench;
  struct rlimit before {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &before), 0);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const struct rlimit small { 200'000, before.rlim_max };  // no file may be larger
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const Result<ScanReport> report = bench.scan(folder / "s");
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(report.error().message(), HasSubstr("has no room for the scan: 1 MiB are needed"));
  EXPECT_EQ(bench.writes, 0);
  EXPECT_THAT(files_in(folder / "s"), ElementsAre());
  expect_at_rest(bench);
}

TEST(RunScan, TheReserveGivesWayWhileImagesAreWritten) {
  const TemporaryFolder folder;
  TestBench bench;
  std::vector<std::uintmax_t> reserved;
  bench.before_write = [&](int) {
    reserved.push_back(std::filesystem::file_size(folder / "s" / SpaceReserve::file_name));
    return Result<void>{};
  };
  ASSERT_TRUE(bench.scan(folder / "s"));
  ASSERT_EQ(reserved.size(), 25U);  // session.json at first, then image and session.json
  const std::uintmax_t a_view = reserved[0] / 12;
  EXPECT_GT(a_view, 96U * 72U);
  for (std::size_t view = 0; view < 12; ++view) {
    EXPECT_EQ(reserved[1 + 2 * view], reserved[0] - (view + 1) * a_view);
  }
  EXPECT_EQ(reserved.back(), 0U);
}

TEST(RunScan, AWriteThatFailsAnywhereEndsTheScanAndLosesNothing) {
  for (int failing = 1; failing <= 25; ++failing) {
    const TemporaryFolder folder;
    TestBench bench;
    bench.use_instant_turntable();
    bench.before_write = [&](int write) -> Result<void> {
      if (write == failing) return fail(ErrorKind::bad_input, "disk", "No space left on device");
      return {};
    };
    const Result<ScanReport> report = bench.scan(folder / "s");
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(report.error().message(), HasSubstr("No space left on device"));
    expect_at_rest(bench);
    if (failing > 1) {
      EXPECT_EQ(expect_valid_session(folder / "s").views.size(),
                static_cast<std::size_t>((failing - 2) / 2));
    }
  }
}

// ---- options ----

TEST(RunScan, SenselessOptionsAreUsageErrors) {
  const TemporaryFolder folder;
  const std::pair<std::function<void(TestBench&)>, const char*> cases[] = {
      {[](TestBench& b) { b.options.plan.passes = 0; }, "passes: must be from 1 to 10"},
      {[](TestBench& b) { b.options.max_attempts = 0; }, "max_attempts: must be from 1 to 100"},
      {[](TestBench& b) { b.options.settle_time = std::chrono::milliseconds(-1); },
       "settle_time: must not be negative"},
      {[](TestBench& b) { b.options.motion_interval = std::chrono::milliseconds(-1); },
       "motion_interval: must not be negative"},
      {[](TestBench& b) { b.options.frame_timeout = std::chrono::milliseconds(0); },
       "frame_timeout: must be greater than 0"},
      {[](TestBench& b) { b.options.gates.max_dark_percent = 101.0; },
       "max_dark_percent: must be from 0 to 100, not 101"},
      {[](TestBench& b) { b.options.plan.rings.pop_back(); }, "camera \"cam1\" has no ring"},
      {[](TestBench& b) {
         b.options.plan.rings.push_back({"cam7", 3});
       },
       "the station has no camera \"cam7\""},
  };
  for (const auto& [spoil, expected] : cases) {
    TestBench bench;
    spoil(bench);
    const Result<ScanReport> report = bench.scan(folder / "s");
    ASSERT_FALSE(report) << expected;
    EXPECT_EQ(report.error().kind, ErrorKind::usage);
    EXPECT_THAT(report.error().message(), HasSubstr(expected));
    EXPECT_EQ(bench.camera0.requests, 0);
  }
}

}  // namespace
}  // namespace skullstation
