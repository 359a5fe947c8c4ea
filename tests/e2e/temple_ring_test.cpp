// Somebody else's photographs become a session by docs/examples/temple_ring_session.

#include <gtest/gtest.h>

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
  const SessionCamera& camera = session->cameras.at(0);
  const Lens lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
  // The published tight bounding box, in mm: every camera must see all of it or nearly so.
  const Eigen::Vector3d low(-23.121, -38.009, -91.940);
  const Eigen::Vector3d high(78.626, 121.636, -17.395);
  for (const SessionView& view : session->views) {
    ASSERT_TRUE(view.camera_from_table);
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3d x((corner & 1) != 0 ? high.x() : low.x(),
                              (corner & 2) != 0 ? high.y() : low.y(),
                              (corner & 4) != 0 ? high.z() : low.z());
      const Eigen::Vector3d x_camera = *view.camera_from_table * x;
      ASSERT_GT(x_camera.z(), 100.0) << view.image;
      const Eigen::Vector2d px = lens.project(x_camera);
      EXPECT_GT(px.x(), -40.0) << view.image;
      EXPECT_LT(px.x(), 680.0) << view.image;
      EXPECT_GT(px.y(), -40.0) << view.image;
      EXPECT_LT(px.y(), 520.0) << view.image;
    }
    const auto image = read_image(folder / "temple" / view.image);
    ASSERT_TRUE(image) << image.error().message();
    EXPECT_EQ(image->width, 640);
  }
  const auto check =
      skullstation::testing::skullstation_cli({"session", "check", (folder / "temple").string()});
  EXPECT_EQ(check.exit_code, 0) << check.err;
}

}  // namespace
}  // namespace skullstation
