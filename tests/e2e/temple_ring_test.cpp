// Somebody else's photographs become a session by docs/examples/temple_ring_session.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>

#include "core/file.h"
#include "core/session/image_file.h"
#include "core/session/session.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::Process;
using skullstation::testing::TemporaryFolder;

TEST(TempleRing, BecomesASessionWhoseCamerasSeeTheTemple) {
  const auto data = skullstation::testing::real_data_folder() / "temple-ring";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "real data is not here: " << data;
  const TemporaryFolder folder;
  const auto example =
      std::filesystem::path(SKULLSTATION_SOURCE_DIR) / "docs" / "examples" / "temple_ring_session";
  const auto made = Process({example.string(), data.string(), (folder / "temple").string()}).wait();
  ASSERT_EQ(made.exit_code, 0) << made.err;

  const auto session = read_session(folder / "temple");
  ASSERT_TRUE(session) << session.error().message();
  ASSERT_EQ(session->views.size(), 47U);
  // The published tight bounding box, in mm: every camera must see all of it or nearly so.
  const Eigen::Vector3d low(-23.121, -38.009, -91.940);
  const Eigen::Vector3d high(78.626, 121.636, -17.395);
  for (const SessionView& view : session->views) {
    ASSERT_TRUE(view.camera_from_table);
    const SessionCamera& camera =
        *std::ranges::find(session->cameras, view.camera, &SessionCamera::id);
    const Lens lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
    double left = 640.0;
    double right = 0.0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d x((corner & 1) != 0 ? high.x() : low.x(),
                              (corner & 2) != 0 ? high.y() : low.y(),
                              (corner & 4) != 0 ? high.z() : low.z());
      const Eigen::Vector3d x_camera = *view.camera_from_table * x;
      ASSERT_GT(x_camera.z(), 100.0) << view.image;
      const Eigen::Vector2d px = lens.project(x_camera);
      left = std::min(left, px.x());
      right = std::max(right, px.x());
      EXPECT_GT(px.x(), -40.0) << view.image;
      EXPECT_LT(px.x(), 680.0) << view.image;
      EXPECT_GT(px.y(), -40.0) << view.image;
      EXPECT_LT(px.y(), 520.0) << view.image;
    }
    const auto image = read_image(folder / "temple" / view.image);
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->width, 640);
    // What is bright lies where the box has it: a photograph that is turned would not.
    int first = image->width;
    int last = 0;
    for (int y = 0; y < image->height; ++y) {
      for (int x = 0; x < image->width; ++x) {
        if (image->at(x, y, 0) < 100) continue;
        first = std::min(first, x);
        last = std::max(last, x);
      }
    }
    EXPECT_NEAR(0.5 * (first + last), 0.5 * (left + right), 30.0) << view.image;
  }
  const auto check =
      skullstation::testing::skullstation_cli({"session", "check", (folder / "temple").string()});
  EXPECT_EQ(check.exit_code, 0) << check.err;
}

bool long_form() {
  const char* wanted = std::getenv("SKULLSTATION_LONG");
  return wanted != nullptr && std::string(wanted) == "1";
}

// The published poses give frame and scale; that each of the 47 comes out where it was published is
// what structure from motion has to show. Some minutes.
TEST(TempleRing, ItsPosesAreFoundFromThePhotographsAlone) {
  const auto data = skullstation::testing::real_data_folder() / "temple-ring";
  if (!std::filesystem::exists(data)) GTEST_SKIP() << "real data is not here: " << data;
  if (!long_form()) GTEST_SKIP() << "SKULLSTATION_LONG=1 runs it";
  const TemporaryFolder folder;
  const auto example =
      std::filesystem::path(SKULLSTATION_SOURCE_DIR) / "docs" / "examples" / "temple_ring_session";
  ASSERT_EQ(Process({example.string(), data.string(), folder / "temple"}).wait().exit_code, 0);
  const auto result = skullstation::testing::skullstation_cli({"reconstruct", folder / "temple",
                                                               "--out", folder / "out", "--poses",
                                                               "sfm", "--quality", "draft"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto given = read_session(folder / "temple");
  const auto cameras = read_file(folder / "out" / "cameras.json");
  ASSERT_TRUE(given && cameras);
  const auto found = parse_session(*cameras, "cameras.json");
  ASSERT_TRUE(found) << found.error().message();
  for (std::size_t i = 0; i < given->views.size(); ++i) {
    ASSERT_TRUE(found->views[i].camera_from_table) << found->views[i].image;
    const Rigid3& expected = *given->views[i].camera_from_table;
    const Rigid3& actual = *found->views[i].camera_from_table;
    EXPECT_LT(rotation_distance_deg(expected, actual), 0.5) << found->views[i].image;
    // 3.5 mm at 570 mm are a third of a degree about the temple, about what the published poses and
    // features of 640 x 480 pixels differ by.
    EXPECT_LT((expected.inverse().translation - actual.inverse().translation).norm(), 3.5)
        << found->views[i].image;
  }
}

}  // namespace
}  // namespace skullstation
