// `skullstation scan` on the simulated station with a real skull. SKULLSTATION_LONG=1: 96 views of
// 1600x1200; otherwise fewer and smaller ones.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/session.h"
#include "core/units.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::skullstation_cli;
using skullstation::testing::TemporaryFolder;

bool long_form() {
  const char* wanted = std::getenv("SKULLSTATION_LONG");
  return wanted != nullptr && std::string(wanted) == "1";
}

TEST(Scan, OfARealSkullIsCompleteAndItsAnglesAreTrue) {
  const auto skull = skullstation::testing::real_data_folder() / "skull-bodyparts3d" / "skull.ply";
  if (!std::filesystem::exists(skull)) GTEST_SKIP() << "real data is not here: " << skull;
  const int views_per_ring = long_form() ? 24 : 8;
  const int width = long_form() ? 1600 : 800;
  const TemporaryFolder folder;
  std::ofstream(folder / "station.toml")
      << "[scan]\nviews_per_ring = " << views_per_ring << "\n[simulation]\nspecimen = \""
      << skull.string() << "\"\nrender_samples = " << (long_form() ? 4 : 1)
      << "\n[[camera]]\nid = \"cam0\"\nwidth = " << width << "\nheight = " << width * 3 / 4
      << "\n[camera.simulated]\nelevation_deg = 15\n[[camera]]\nid = \"cam1\"\nwidth = " << width
      << "\nheight = " << width * 3 / 4
      << "\n[camera.simulated]\nelevation_deg = 45\nazimuth_deg = -82.5\n";
  const auto result = skullstation_cli({"scan", "--config", folder / "station.toml", "--out",
                                        folder / "session", "--case", "2026-0042"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, ::testing::Not(::testing::HasSubstr("not good enough")));

  const auto session = read_session(folder / "session");
  ASSERT_TRUE(session) << session.error().message();
  ASSERT_TRUE(verify_images(*session, folder / "session"));
  EXPECT_EQ(session->views.size(), 4U * static_cast<std::size_t>(views_per_ring));
  EXPECT_TRUE(session->complete.value_or(false));
  EXPECT_EQ(session->case_number, "2026-0042");

  const auto truth =
      nlohmann::json::parse(*read_file(folder / "session" / "simulation_truth.json"));
  double worst_deg = 0.0;
  for (const SessionView& view : session->views) {
    ASSERT_TRUE(view.quality) << view.image;
    EXPECT_FALSE(view.quality->rejected) << view.image << ": " << *view.quality->rejected;
    EXPECT_GT(view.quality->sharpness, 0.0) << view.image;
    EXPECT_GT(view.quality->mean_level, 0.0) << view.image;
    ASSERT_TRUE(view.table_angle_deg) << view.image;
    const double true_deg = truth["views"][view.image]["table_angle_deg"];
    worst_deg = std::max(worst_deg, std::abs(turn_deg(true_deg, *view.table_angle_deg)));
  }
  EXPECT_LT(worst_deg, 0.05);
  std::cout << session->views.size() << " views, largest difference between recorded and true "
            << "table angle " << worst_deg << " deg\n";
}

}  // namespace
}  // namespace skullstation
