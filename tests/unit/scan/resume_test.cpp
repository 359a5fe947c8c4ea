#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>

#include "capture/scan/scan_session.h"
#include "capture/scan/space_reserve.h"
#include "core/file.h"
#include "core/session/session.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/scan/test_bench.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;

using testing::Crash;
using ::testing::ElementsAre;
using testing::files_in;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::TemporaryFolder;
using testing::TestBench;

/// Image and hash of each recorded view; nothing if there is no session yet.
std::map<std::string, std::string> recorded_hashes(const fs::path& folder) {
  std::map<std::string, std::string> hashes;
  if (!fs::exists(folder / "session.json")) return hashes;
  const Result<Session> session = read_session(folder);
  EXPECT_TRUE(session) << session.error().message();
  const Result<void> intact = verify_images(*session, folder);
  EXPECT_TRUE(intact) << intact.error().message();
  for (const SessionView& view : session->views) hashes[view.image] = *view.sha256;
  return hashes;
}

std::set<std::string> complete_files(const TestBench& bench) {
  std::set<std::string> files{"session.json"};
  for (const PlannedView& view : planned_views(bench.options.plan)) files.insert(view.image);
  return files;
}

/// The same command again: all that was recorded is kept as it was, the rest is taken.
void expect_resumes(const fs::path& folder, const std::string& when) {
  const std::map<std::string, std::string> before = recorded_hashes(folder);
  // What a real crash leaves behind besides.
  std::ofstream(folder / SpaceReserve::file_name) << std::string(10'000, 'x');
  TestBench bench;
  bench.use_instant_turntable();
  const Result<ScanReport> report = bench.scan(folder);
  ASSERT_TRUE(report) << when << report.error().message();
  EXPECT_EQ(report->kept, static_cast<int>(before.size())) << when;
  EXPECT_EQ(report->taken, 12 - static_cast<int>(before.size())) << when;
  EXPECT_THAT(report->replaced, IsEmpty()) << when;
  const std::map<std::string, std::string> after = recorded_hashes(folder);
  EXPECT_EQ(after.size(), 12U) << when;
  for (const auto& [image, hash] : before) EXPECT_EQ(after.at(image), hash) << when << image;
  EXPECT_EQ(read_session(folder)->complete, true);
  EXPECT_EQ(files_in(folder), complete_files(bench)) << when;
  for (const PlacementRequest& request : bench.placements) {
    int recorded_in_pass = 0;
    const std::string prefix = "images/p" + std::to_string(request.pass);
    for (const auto& [image, hash] : before) recorded_in_pass += image.starts_with(prefix);
    EXPECT_EQ(request.continued, recorded_in_pass > 0) << when << request.pass;
  }
}

template <class Arrange>
void crash_and_resume(const std::string& when, const Arrange& arrange) {
  const TemporaryFolder folder;
  TestBench bench;
  bench.use_instant_turntable();
  arrange(bench);
  ASSERT_THROW(static_cast<void>(bench.scan(folder.path())), Crash) << when;
  EXPECT_FALSE(bench.motor_is_on()) << when;
  EXPECT_FALSE(bench.station.lights_on()) << when;
  expect_resumes(folder.path(), when);
}

TEST(Resume, AfterACrashAtEveryWrite) {
  for (int write = 1; write <= 25; ++write) {
    crash_and_resume("in the middle of write " + std::to_string(write) + ": ",
                     [write](TestBench& bench) {
                       bench.before_write = [write](int n) -> Result<void> {
                         if (n == write) throw Crash{};
                         return {};
                       };
                     });
    crash_and_resume("after write " + std::to_string(write) + ": ", [write](TestBench& bench) {
      bench.after_write = [write](int n) {
        if (n == write) throw Crash{};
      };
    });
  }
}

TEST(Resume, AfterACrashAtEveryFrame) {
  for (int frame = 1; frame <= 17; ++frame) {
    crash_and_resume("at frame " + std::to_string(frame) + ": ", [frame](TestBench& bench) {
      bench.camera0.on_request = [frame](int n) {
        if (n == frame) throw Crash{};
      };
    });
  }
}

TEST(Resume, AfterACrashWhileTheSpecimenIsTurnedOver) {
  crash_and_resume("turning over: ", [](TestBench& bench) {
    bench.on_placement = [](const PlacementRequest&) { throw Crash{}; };
  });
}

TEST(Resume, AfterSeveralCrashes) {
  const TemporaryFolder folder;
  for (int crashes = 0; crashes < 5; ++crashes) {
    TestBench bench;
    bench.after_write = [](int write) {
      if (write == 4) throw Crash{};  // the session, an image, the session, an image
    };
    EXPECT_THROW(static_cast<void>(bench.scan(folder.path())), Crash);
    EXPECT_EQ(recorded_hashes(folder.path()).size(), static_cast<std::size_t>(crashes) + 1U);
  }
  expect_resumes(folder.path(), "after five crashes: ");
}

TEST(Resume, ACompleteSessionIsLeftAloneAndNeedsNoHardware) {
  const TemporaryFolder folder;
  ASSERT_TRUE(TestBench().scan(folder.path()));
  const std::string before = *read_file(folder / "session.json");
  TestBench bench;
  bench.camera0.unplugged_at = {1};
  bench.camera0.can_be_reopened = false;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->kept, 12);
  EXPECT_EQ(report->taken, 0);
  EXPECT_EQ(bench.camera0.requests, 0);
  EXPECT_EQ(*read_file(folder / "session.json"), before);
}

/// Records `views` views and stops.
void scan_partly(const fs::path& folder, int views) {
  TestBench bench;
  bench.before_write = [views](int write) -> Result<void> {
    if (write == 2 + 2 * views) return fail(ErrorKind::bad_input, "disk", "full");
    return {};
  };
  ASSERT_FALSE(bench.scan(folder));
  ASSERT_EQ(recorded_hashes(folder).size(), static_cast<std::size_t>(views));
}

void damage(const fs::path& image) { std::ofstream(image, std::ios::app) << "x"; }

TEST(Resume, DamagedAndMissingImagesOfTheCurrentPlacementAreTakenAgain) {
  const TemporaryFolder folder;
  scan_partly(folder.path(), 10);
  const std::map<std::string, std::string> before = recorded_hashes(folder.path());
  damage(folder / "images/p1_c0_000.png");
  fs::remove(folder / "images/p1_c1_000.png");
  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->kept, 8);
  EXPECT_EQ(report->taken, 4);
  EXPECT_THAT(report->replaced, ElementsAre("images/p1_c0_000.png", "images/p1_c1_000.png"));
  ASSERT_EQ(bench.placements.size(), 1U);
  EXPECT_EQ(bench.placements[0].pass, 1);
  EXPECT_TRUE(bench.placements[0].continued);
  const std::map<std::string, std::string> after = recorded_hashes(folder.path());
  EXPECT_EQ(after.at("images/p0_c0_000.png"), before.at("images/p0_c0_000.png"));
  EXPECT_EQ(after.at("images/p1_c0_001.png"), before.at("images/p1_c0_001.png"));
}

TEST(Resume, APassWhosePlacementIsGoneIsTakenAgainAsAWhole) {
  const TemporaryFolder folder;
  scan_partly(folder.path(), 10);
  const std::map<std::string, std::string> before = recorded_hashes(folder.path());
  damage(folder / "images/p0_c0_002.png");
  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->kept, 4);
  EXPECT_EQ(report->taken, 8);
  EXPECT_EQ(report->replaced.size(), 6U);
  EXPECT_EQ(report->replaced[0], "images/p0_c0_002.png");
  // The placement that still exists comes first.
  ASSERT_EQ(bench.placements.size(), 2U);
  EXPECT_EQ(bench.placements[0].pass, 1);
  EXPECT_TRUE(bench.placements[0].continued);
  EXPECT_EQ(bench.placements[1].pass, 0);
  EXPECT_FALSE(bench.placements[1].continued);
  const std::map<std::string, std::string> after = recorded_hashes(folder.path());
  EXPECT_EQ(after.size(), 12U);
  for (const auto& [image, hash] : before) {
    if (image.starts_with("images/p1")) {
      EXPECT_EQ(after.at(image), hash);
    }
  }
}

TEST(Resume, ThatRepetitionMayBeInterruptedToo) {
  const TemporaryFolder folder;
  ASSERT_TRUE(TestBench().scan(folder.path()));
  damage(folder / "images/p0_c0_002.png");
  TestBench interrupted;
  interrupted.before_write = [](int write) -> Result<void> {
    if (write == 8) throw Crash{};  // three views of pass 0 are recorded anew
    return {};
  };
  EXPECT_THROW(static_cast<void>(interrupted.scan(folder.path())), Crash);
  ASSERT_EQ(interrupted.placements.size(), 1U);
  EXPECT_EQ(interrupted.placements[0].pass, 0);
  EXPECT_FALSE(interrupted.placements[0].continued);
  EXPECT_EQ(recorded_hashes(folder.path()).size(), 9U);

  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_EQ(report->kept, 9);
  ASSERT_EQ(bench.placements.size(), 1U);
  EXPECT_EQ(bench.placements[0].pass, 0);
  EXPECT_TRUE(bench.placements[0].continued);
}

// ---- sessions of another scan ----

TEST(Resume, AnotherPlanIsRefusedAndTheDifferenceNamed) {
  const TemporaryFolder folder;
  scan_partly(folder.path(), 3);
  const std::string before = *read_file(folder / "session.json");
  const std::pair<std::function<void(TestBench&)>, const char*> cases[] = {
      {[](TestBench& b) { b.options.case_number = "2026-0043"; },
       "the case was \"2026-0042\" and now is \"2026-0043\""},
      {[](TestBench& b) { b.options.station = "ST-02"; },
       "the station was \"ST-01\" and now is \"ST-02\""},
      {[](TestBench& b) { b.options.plan.passes = 1; },
       "the number of passes was \"2\" and now is \"1\""},
      {[](TestBench& b) { b.options.plan.rings[0].views = 8; },
       "the rings was \"cam0 (4 views), cam1 (2 views)\" and now is \"cam0 (8 views), cam1"},
      {[](TestBench& b) { b.options.plan.image_format = PhotographFormat::jpeg; },
       "\"images/p0_c0_000.png\" is not in the plan"},
      {[](TestBench& b) { b.options.board = CharucoBoard{}; },
       "the board was \"none\" and now is \"DICT_5X5_1000 14x14, squares 25 mm"},
      {[](TestBench& b) { b.lens = Lens{96, 72, 120, 120, 48, 36}; },
       "the calibration of cam0 was \"not calibrated\" and now is \"OPENCV [120, 120, 48"},
      {[](TestBench& b) {
         b.camera1.picture = [](int) { return testing::good_picture(48, 36, 1); };
       },
       "the pictures of cam1 had 96x72 px and now have 48x36"},
  };
  for (const auto& [change, expected] : cases) {
    TestBench bench;
    change(bench);
    const Result<ScanReport> report = bench.scan(folder.path());
    ASSERT_FALSE(report) << expected;
    EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(report.error().message(), HasSubstr("holds a session of another scan"));
    EXPECT_THAT(report.error().message(), HasSubstr(expected));
    EXPECT_EQ(*read_file(folder / "session.json"), before);
    EXPECT_FALSE(bench.motor_is_on());
  }
}

TEST(Resume, SessionsMadeByHandAreNotContinued) {
  const TemporaryFolder folder;
  TestBench bench;
  Session session;
  session.station = bench.options.station;
  session.case_number = bench.options.case_number;
  session.cameras = {{"cam0", 96, 72, LensModel::opencv, std::nullopt, true}};
  ASSERT_TRUE(write_session(session, folder.path()));
  EXPECT_THAT(bench.scan(folder.path()).error().message(), HasSubstr("it has no plan"));
}

TEST(Resume, OtherPeoplesFilesAreNotMixedWith) {
  const TemporaryFolder folder;
  std::ofstream(folder / "thesis.txt") << "mine";
  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(report.error().message(),
              HasSubstr("is not empty (thesis.txt) and is no capture session"));
  EXPECT_THAT(files_in(folder.path()), ElementsAre("thesis.txt"));
}

TEST(Resume, ABrokenSessionFileIsNotOverwritten) {
  const TemporaryFolder folder;
  std::ofstream(folder / "session.json") << "{ \"format\"";
  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder.path());
  ASSERT_FALSE(report);
  EXPECT_THAT(report.error().message(), HasSubstr("session.json: line 1"));
  EXPECT_EQ(*read_file(folder / "session.json"), "{ \"format\"");
}

TEST(Resume, TwoScansIntoOneFolderAreNot) {
  const TemporaryFolder folder;
  TestBench first;
  std::optional<Result<ScanReport>> second;
  first.camera0.on_request = [&](int request) {
    if (request == 3) second = TestBench().scan(folder.path());
  };
  ASSERT_TRUE(first.scan(folder.path()));
  ASSERT_TRUE(second);
  ASSERT_FALSE(*second);
  EXPECT_THAT(second->error().message(), HasSubstr("is in use by another scan"));
}

TEST(Resume, AFileInPlaceOfTheFolderIsAnError) {
  const TemporaryFolder folder;
  std::ofstream(folder / "s") << "a file";
  TestBench bench;
  const Result<ScanReport> report = bench.scan(folder / "s");
  ASSERT_FALSE(report);
  EXPECT_EQ(report.error().kind, ErrorKind::bad_input);
}

TEST(Resume, OwnFilesBesideTheImagesStay) {
  const TemporaryFolder folder;
  scan_partly(folder.path(), 3);
  std::ofstream(folder / "notes.txt") << "a note";
  std::ofstream(folder / "images/mask_0.png") << "a mask";
  ASSERT_TRUE(TestBench().scan(folder.path()));
  EXPECT_TRUE(fs::exists(folder / "notes.txt"));
  EXPECT_TRUE(fs::exists(folder / "images/mask_0.png"));
}

}  // namespace
}  // namespace skullstation
