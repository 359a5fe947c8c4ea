// kill -9 at random moments of a scan, then the same command again: no view that was recorded is
// lost, and none that is recorded is damaged. SKULLSTATION_LONG=1: 50 kills instead of 12.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <map>

#include "core/random.h"
#include "core/session/session.h"
#include "tests/e2e/small_station.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using skullstation::testing::Process;
using skullstation::testing::TemporaryFolder;

using HashOfImage = std::map<std::string, std::string>;

/// What session.json records, after checking that each recorded image is intact.
HashOfImage recorded_views(const std::filesystem::path& folder) {
  HashOfImage hashes;
  if (!std::filesystem::exists(folder / "session.json")) return hashes;
  const auto session = read_session(folder);
  EXPECT_TRUE(session) << session.error().message();
  if (!session) return hashes;
  const auto intact = verify_images(*session, folder);
  EXPECT_TRUE(intact) << intact.error().message();
  for (const SessionView& view : session->views) hashes[view.image] = view.sha256.value_or("");
  return hashes;
}

TEST(InterruptedScan, SurvivesBeingKilledAtRandomMoments) {
  const bool long_form = std::getenv("SKULLSTATION_LONG") != nullptr &&
                         std::string(std::getenv("SKULLSTATION_LONG")) == "1";
  const int kills_wanted = long_form ? 50 : 12;
  const TemporaryFolder folder;
  skullstation::testing::SmallStation small;
  small.views_per_ring = 24;
  const auto config = write_small_station(folder.path(), small);
  const std::vector<std::string> command{skullstation::testing::skullstation_program().string(),
                                         "scan",
                                         "--config",
                                         config.string(),
                                         "--out",
                                         (folder / "session").string()};
  Random random(20260131);
  int kills = 0;
  int resumed = 0;
  std::chrono::milliseconds longest = 2000ms;
  while (kills < kills_wanted) {
    const HashOfImage before = recorded_views(folder / "session");
    Process scan(command);
    const auto moment =
        std::chrono::milliseconds(random.below(static_cast<std::uint64_t>(longest.count())));
    if (scan.wait_for(moment)) {
      // Finished before its moment came: a complete session, start anew for the next kills.
      const auto result = scan.wait();
      ASSERT_EQ(result.exit_code, 0) << result.err;
      EXPECT_EQ(recorded_views(folder / "session").size(), 96U);
      std::filesystem::remove_all(folder / "session");
      continue;
    }
    scan.send(SIGKILL);
    scan.wait();
    const HashOfImage after = recorded_views(folder / "session");
    kills += after.empty() ? 0 : 1;
    for (const auto& [image, hash] : before) {
      ASSERT_TRUE(after.contains(image)) << image << " was recorded and is lost, kill " << kills;
      EXPECT_EQ(after.at(image), hash) << image << " was recorded and has changed";
    }
    // On a slow machine a scan needs longer until there is something to lose.
    if (after.size() == before.size()) longest += longest / 2;
    resumed += before.empty() ? 0 : 1;
  }
  EXPECT_GT(resumed, kills_wanted / 4) << "too few kills hit a session under way";
  const auto result = Process(command).wait();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(recorded_views(folder / "session").size(), 96U);
  EXPECT_TRUE(read_session(folder / "session")->complete.value_or(false));
  RecordProperty("kills", kills);
}

}  // namespace
}  // namespace skullstation
