#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "daemon/model/model_source.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/registration/skull_template.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::ProcessResult;
using testing::skullstation_cli;
using testing::TemporaryFolder;

constexpr const char* triangle =
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\n"
    "property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";

TEST(Approximate, SaysWhatIsWrongWithItsInputs) {
  const TemporaryFolder folder;
  const std::string skull = (folder / "skull.ply").string();
  const std::string model = (folder / "model.h5").string();
  const std::string out = (folder / "case").string();
  ASSERT_TRUE(write_file_durably(skull, triangle));
  const auto approximate = [&](std::vector<std::string> more) {
    std::vector<std::string> arguments = {"approximate", skull, "--model", model, "--out", out};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return skullstation_cli(arguments);
  };
  ProcessResult result = approximate({});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("model.h5"));

  ASSERT_TRUE(write_file_durably(model, "no model at all"));
  result = approximate({});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("not a whole HDF5 file"));

  result = approximate({"--age", "7"});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("age: must be 15 to 110"));
  EXPECT_EQ(approximate({"--sex", "unknown"}).exit_code, 2);

  ASSERT_TRUE(make_writable_folder(out));
  ASSERT_TRUE(write_file_durably(folder / "case/notes.txt", "keep me"));
  result = approximate({});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is not empty"));
  EXPECT_FALSE(std::filesystem::exists(folder / "case/report.html"));
}

/// A box of 150 mm with as many vertices as a scan has.
TriangleMesh cube() {
  constexpr int cells = 40;
  constexpr double half_mm = 75.0;
  TriangleMesh mesh;
  mesh.vertices.resize(6 * (cells + 1) * (cells + 1), 3);
  mesh.triangles.resize(12 * cells * cells, 3);
  int vertex = 0;
  int triangle_at = 0;
  for (int side = 0; side < 6; ++side) {
    const int axis = side / 2;
    const bool upper = side % 2 == 1;
    const auto corner = [&](int i, int j) { return vertex + i * (cells + 1) + j; };
    for (int i = 0; i < cells; ++i) {
      for (int j = 0; j < cells; ++j) {
        const int a = corner(i, j), b = corner(i + 1, j), c = corner(i + 1, j + 1),
                  d = corner(i, j + 1);
        if (upper) {
          mesh.triangles.row(triangle_at++) << a, b, c;
          mesh.triangles.row(triangle_at++) << a, c, d;
        } else {
          mesh.triangles.row(triangle_at++) << a, c, b;
          mesh.triangles.row(triangle_at++) << a, d, c;
        }
      }
    }
    for (int i = 0; i <= cells; ++i) {
      for (int j = 0; j <= cells; ++j) {
        mesh.vertices(vertex, axis) = upper ? half_mm : -half_mm;
        mesh.vertices(vertex, (axis + 1) % 3) = half_mm * (2.0 * i / cells - 1.0);
        mesh.vertices(vertex, (axis + 2) % 3) = half_mm * (2.0 * j / cells - 1.0);
        ++vertex;
      }
    }
  }
  return mesh;
}

/// The default model's mean skull.
TriangleMesh mean_skull() {
  const auto source = load_model({}).value();
  const FaceModel& model = source.model;
  const Points3 vertices = unflattened(model.skull.mean);
  return surface_of(model.skull_template, vertices.topRows(model.skull_template.boundary_count));
}

class ApproximateRefuses : public ::testing::Test {
 protected:
  void refuses(const TriangleMesh& mesh, const std::string& why, int exit_code = 3) {
    const std::string skull = (folder / "bone.ply").string();
    ASSERT_TRUE(write_ply(mesh, skull));
    const ProcessResult result =
        skullstation_cli({"approximate", skull, "--out", (folder / "case").string()});
    EXPECT_EQ(result.exit_code, exit_code);
    EXPECT_THAT(result.err, HasSubstr("bone.ply"));
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(std::filesystem::exists(folder / "case"));
  }

  TemporaryFolder folder;
};

TEST_F(ApproximateRefuses, ACube) { refuses(cube(), "is it the same kind of object", 5); }

TEST_F(ApproximateRefuses, AnEmptyMesh) { refuses({}, "the mesh is empty"); }

TEST_F(ApproximateRefuses, Metres) {
  TriangleMesh skull = mean_skull();
  skull.vertices *= 0.001;
  refuses(skull, "is it in metres");
}

TEST_F(ApproximateRefuses, AMirroredSkull) {
  TriangleMesh skull = mean_skull();
  skull.vertices.col(0) *= -1.0;
  refuses(skull, "face inwards");
}

/// Both in one mesh, the second 250 mm to the side.
TriangleMesh beside(const TriangleMesh& first, const TriangleMesh& second) {
  const Eigen::Index count = first.vertices.rows();
  TriangleMesh both;
  both.vertices.resize(count + second.vertices.rows(), 3);
  both.vertices << first.vertices, second.vertices;
  both.vertices.bottomRows(second.vertices.rows()).col(0).array() += 250.0;
  both.triangles.resize(first.triangles.rows() + second.triangles.rows(), 3);
  both.triangles << first.triangles, second.triangles.array() + static_cast<int>(count);
  return both;
}

TEST_F(ApproximateRefuses, TwoSkulls) {
  const TriangleMesh skull = mean_skull();
  refuses(beside(skull, skull), "of the surface fits the other", 5);
}

TEST_F(ApproximateRefuses, ASkullBesideAnotherObject) {
  refuses(beside(mean_skull(), cube()), "give one adult human skull and nothing else");
}

TEST(Approximate, IsTheSameBytesForAnyNumberOfThreads) {
  const TemporaryFolder folder;
  const std::string skull = (folder / "skull.ply").string();
  ASSERT_TRUE(write_ply(mean_skull(), skull));
  for (const char* threads : {"1", "2"}) {
    const ProcessResult result = skullstation_cli(
        {"approximate", skull, "--out", (folder / threads).string(), "--threads", threads, "--bmi",
         "24", "--ancestry", "unknown", "--most-triangles", "50000"});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.out, HasSubstr("triangles were thinned to"));
  }
  int compared = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder / "1")) {
    if (!entry.is_regular_file()) continue;
    const auto other = folder / "2" / std::filesystem::relative(entry.path(), folder / "1");
    EXPECT_TRUE(read_file(entry.path()).value() == read_file(other).value()) << other;
    ++compared;
  }
  EXPECT_GE(compared, 20);
}

TEST(ModelCommands, NameWhatTheyCantRead) {
  const TemporaryFolder folder;
  ProcessResult result = skullstation_cli({"model", "info", (folder / "none.h5").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("none.h5"));
  result = skullstation_cli({"model", "build", "--subjects", folder.path().string(), "--template",
                             (folder / "none.bin").string(), "--fits", (folder / "fits").string(),
                             "--out", (folder / "model.h5").string(), "--card", "nobody"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("none.bin"));
}

}  // namespace
}  // namespace skullstation
