#include "daemon/report/captioned_pictures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

namespace skullstation {
namespace {

using ::testing::ElementsAre;
using ::testing::Key;

TEST(ScalarColors, RunFromDarkBlueToYellowAndLeaveTheUnknownGrey) {
  const Colors colors = scalar_colors(Eigen::Vector4d(-5.0, 2.0, 30.0, std::nan("")), 2.0, 25.0);
  EXPECT_EQ(colors.row(0), Eigen::RowVector3i(68, 1, 84).cast<std::uint8_t>());
  EXPECT_EQ(colors.row(1), colors.row(0));
  EXPECT_EQ(colors.row(2), Eigen::RowVector3i(253, 231, 37).cast<std::uint8_t>());
  EXPECT_EQ(colors.row(3), Eigen::RowVector3i(150, 150, 150).cast<std::uint8_t>());
}

TEST(AddSides, CaptionsEachPictureWithItsSide) {
  TriangleMesh mesh;
  mesh.vertices = 50.0 * Points3::Identity(3, 3);
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  PicturedMesh pictured;
  pictured.mesh = &mesh;
  CaptionedPictures pictures;
  const ReportPictureOptions small{.width_px = 16, .samples = 1, .threads = 1};
  ASSERT_TRUE(add_sides(pictures, {&pictured, 1}, {"left", "front"}, "bone", small));
  ASSERT_TRUE(add_sides(pictures, {&pictured, 1}, {"back"}, "", small));
  EXPECT_THAT(pictures, ElementsAre(Key("bone, left"), Key("bone, front"), Key("back")));
  EXPECT_EQ(pictures[0].second.width, 16);
}

}  // namespace
}  // namespace skullstation
