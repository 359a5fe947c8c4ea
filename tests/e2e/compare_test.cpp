// Two surfaces compared, as a user sees it.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/units.h"
#include "reconstruction/io/mesh_file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

using skullstation::testing::ProcessResult;
using skullstation::testing::skullstation_cli;
using skullstation::testing::sphere;
using skullstation::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// A ball with a nose, so that no motion but the right one brings two of them together.
TriangleMesh lopsided_ball(double radius_mm) {
  TriangleMesh mesh = sphere(radius_mm, 4);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Eigen::Vector3d p = mesh.vertices.row(v) / radius_mm;
    const double nose = 0.3 * std::exp(-8.0 * (p - Eigen::Vector3d(0, -1, 0)).squaredNorm()) +
                        0.2 * std::exp(-6.0 * (p - Eigen::Vector3d(0.6, 0.3, 0.7)).squaredNorm());
    mesh.vertices.row(v) *= 1.0 + nose;
  }
  return mesh;
}

class Compare : public ::testing::Test {
 protected:
  std::filesystem::path write(const char* name, const TriangleMesh& mesh) {
    const auto written = write_mesh(mesh, folder_ / name);
    EXPECT_TRUE(written) << written.error().message();
    return folder_ / name;
  }
  nlohmann::json compared(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), {"compare", "--json"});
    const auto result = skullstation_cli(arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return nlohmann::json::parse(result.out, nullptr, false);
  }
  ProcessResult refused(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), "compare");
    return skullstation_cli(arguments);
  }

  TemporaryFolder folder_;
};

TEST_F(Compare, ConcentricBallsAreTheirRadiiApart) {
  const auto a = write("a.ply", sphere(50.0, 5));
  const auto b = write("b.stl", sphere(51.0, 5));
  const auto json = compared({a, b});
  for (const char* way : {"a_to_b", "b_to_a"}) {
    EXPECT_NEAR(json[way]["mean_mm"], 1.0, 0.05) << way;
    EXPECT_NEAR(json[way]["rms_mm"], 1.0, 0.05) << way;
    EXPECT_NEAR(json[way]["p95_mm"], 1.0, 0.1) << way;
    double sum = 0.0;
    for (const double share : json[way]["histogram"]["share_of_area"]) sum += share;
    EXPECT_NEAR(sum, 1.0, 1e-9) << way;
  }
  EXPECT_LT(json["a_to_b"]["signed_mean_mm"], 0.0) << "A lies inside B";
  const auto text = refused({a, b});
  EXPECT_THAT(text.out, AllOf(HasSubstr("A to B"), HasSubstr("P95"), HasSubstr("distance [mm]")));
}

TEST_F(Compare, AlignmentFindsMotionAndScale) {
  const TriangleMesh ball = lopsided_ball(60.0);
  TriangleMesh moved = ball;
  const Eigen::AngleAxisd turn(radians(8.0), Eigen::Vector3d(1, 2, 3).normalized());
  for (Eigen::Index v = 0; v < moved.vertices.rows(); ++v) {
    moved.vertices.row(v) =
        (1.04 * (turn * Eigen::Vector3d(ball.vertices.row(v))) + Eigen::Vector3d(5, -3, 4));
  }
  const auto a = write("a.ply", ball);
  const auto b = write("b.ply", moved);
  const auto none = compared({a, b});
  const auto rigid = compared({a, b, "--align", "rigid"});
  const auto similarity = compared({a, b, "--align", "similarity"});
  EXPECT_GT(none["a_to_b"]["mean_mm"], 2.0);
  EXPECT_LT(rigid["a_to_b"]["mean_mm"], none["a_to_b"]["mean_mm"]);
  EXPECT_EQ(rigid["scale"], 1.0);
  EXPECT_LT(similarity["a_to_b"]["mean_mm"], 0.05);
  EXPECT_NEAR(similarity["scale"], 1.04, 0.001);
  EXPECT_NEAR(similarity["b_from_a"][0][3], 5.0, 0.1);
}

TEST_F(Compare, TheColouredMeshAndTheRegion) {
  const TriangleMesh ball = sphere(50.0, 3);
  const auto a = write("a.ply", ball);
  const auto b = write("b.ply", sphere(47.0, 3));
  std::ofstream region(folder_ / "top.txt");
  region << "# the upper half\n";
  for (Eigen::Index v = 0; v < ball.vertices.rows(); ++v) {
    if (ball.vertices(v, 2) > 0.0) region << v << "\n";
  }
  region.close();
  const auto json = compared({a, b, "--region", folder_ / "top.txt", "--out",
                              folder_ / "colored.ply", "--full-color-mm", "3"});
  EXPECT_LT(json["a_to_b"]["area_mm2"], 0.6 * surface_area(ball));
  const auto colored = read_mesh(folder_ / "colored.ply");
  ASSERT_TRUE(colored) << colored.error().message();
  ASSERT_EQ(colored->colors.rows(), ball.vertices.rows());
  for (Eigen::Index v = 0; v < ball.vertices.rows(); ++v) {
    const auto color = colored->colors.row(v).cast<int>();
    if (ball.vertices(v, 2) > 0.0) {
      EXPECT_GT(color.x(), color.z() + 100) << "3 mm outside is red";
    } else {
      EXPECT_EQ(color.x(), color.z()) << "what does not count is grey";
    }
  }
}

TEST_F(Compare, MeshesThatAreNoneAreNamed) {
  const auto good = write("good.ply", sphere(50.0, 2));
  const std::string text =
      "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
      "property float z\nelement face 1\nproperty list uchar int vertex_indices\n"
      "end_header\n0 0 0\n1 nan 0\n0 1 0\n3 0 1 2\n";
  ASSERT_TRUE(write_file_durably(folder_ / "nan.ply", text));
  const auto nan = refused({folder_ / "nan.ply", good});
  EXPECT_EQ(nan.exit_code, 3);
  EXPECT_THAT(nan.err, AllOf(HasSubstr("nan.ply"), HasSubstr("11")));

  const std::string bytes = read_file(good).value();
  ASSERT_TRUE(write_file_durably(folder_ / "cut.ply", bytes.substr(0, bytes.size() / 2)));
  const auto cut = refused({good, folder_ / "cut.ply"});
  EXPECT_EQ(cut.exit_code, 3);
  EXPECT_THAT(cut.err, HasSubstr("cut.ply"));

  EXPECT_EQ(refused({good, folder_ / "none.ply"}).exit_code, 3);
  EXPECT_EQ(refused({good, folder_ / "top.txt"}).exit_code, 3);
}

TEST_F(Compare, UsageErrors) {
  const auto good = write("good.ply", sphere(50.0, 2));
  EXPECT_EQ(refused({}).exit_code, 2);
  EXPECT_EQ(refused({good}).exit_code, 2);
  EXPECT_EQ(refused({good, good, "--align", "affine"}).exit_code, 2);
  EXPECT_EQ(refused({good, good, "--full-color-mm", "0"}).exit_code, 2);
  const auto picture = refused({good, good, "--out", folder_ / "colored.png"});
  EXPECT_EQ(picture.exit_code, 2);
  EXPECT_THAT(picture.err, HasSubstr(".ply"));
  ASSERT_TRUE(write_file_durably(folder_ / "region.txt", "3\n99999\n"));
  const auto region = refused({good, good, "--region", folder_ / "region.txt"});
  EXPECT_EQ(region.exit_code, 3);
  EXPECT_THAT(region.err, AllOf(HasSubstr("region.txt"), HasSubstr("line 2")));
}

}  // namespace
}  // namespace skullstation
