#include "reconstruction/io/stl.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "core/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/io/tetrahedron.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using skullstation::testing::tetrahedron;
using ::testing::HasSubstr;

const std::string one_facet =
    "solid a name of several words\n  facet normal 0 0 1\n    outer loop\n      vertex 0 0 0\n"
    "      vertex 1 0 0\n      vertex 0 1 0\n    endloop\n  endfacet\nendsolid a\n";

std::string error_of(const std::string& bytes) {
  const auto mesh = parse_stl(bytes, "a.stl");
  EXPECT_FALSE(mesh.has_value());
  return mesh ? std::string() : mesh.error().message();
}

std::string with(std::string text, const std::string& old_part, const std::string& new_part) {
  return text.replace(text.find(old_part), old_part.size(), new_part);
}

/// The same triangles, corner by corner: STL keeps their order, not the vertices'.
void expect_same_triangles(const TriangleMesh& a, const TriangleMesh& b) {
  ASSERT_EQ(a.triangles.rows(), b.triangles.rows());
  for (Eigen::Index f = 0; f < a.triangles.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      EXPECT_EQ(Eigen::RowVector3d(a.vertices.row(a.triangles(f, corner))),
                Eigen::RowVector3d(b.vertices.row(b.triangles(f, corner))));
    }
  }
}

TEST(Stl, BothKindsAreReadBackWithSharedVertices) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tetrahedron();
  mesh.vertices.array() += 0.1;
  mesh.vertices = mesh.vertices.cast<float>().cast<double>().eval();
  ASSERT_TRUE(write_stl(mesh, folder / "binary.stl"));
  ASSERT_TRUE(write_stl_ascii(mesh, folder / "ascii.stl"));
  for (const char* name : {"binary.stl", "ascii.stl"}) {
    const auto back = read_stl(folder / name);
    ASSERT_TRUE(back) << back.error().message();
    EXPECT_EQ(back->vertices.rows(), 4);
    expect_same_triangles(*back, mesh);
  }
}

TEST(Stl, PlusAndMinusZeroAreOneVertex) {
  const auto mesh = parse_stl(with(one_facet, "vertex 1 0 0", "vertex -0 0 0"), "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->vertices.rows(), 2);
}

TEST(Stl, ABinaryHeaderMayBeginWithSolid) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_stl(tetrahedron(), folder / "t.stl"));
  const std::string bytes = "solid" + read_file(folder / "t.stl")->substr(5);
  const auto mesh = parse_stl(bytes, "t");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.rows(), 4);
}

TEST(Stl, SeveralSolidsAreOneMesh) {
  const auto mesh = parse_stl(one_facet + with(one_facet, "vertex 1 0 0", "vertex 1 1 0"), "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->triangles.rows(), 2);
  EXPECT_EQ(mesh->vertices.rows(), 4);
}

TEST(Stl, EveryDefectOfAnAsciiFileIsNamedWithItsLine) {
  EXPECT_THAT(error_of(""), HasSubstr("a.stl:line 1: not an STL file"));
  EXPECT_THAT(error_of("ply\n"), HasSubstr("line 1: \"solid\" was expected, not \"ply\""));
  EXPECT_THAT(error_of("solid\n"), HasSubstr("the file ends where \"endsolid\" is due"));
  EXPECT_THAT(error_of(with(one_facet, "1 0 0", "1 nan 0")),
              HasSubstr("line 5: a corner is not finite"));
  EXPECT_THAT(error_of(with(one_facet, "1 0 0", "1 zero 0")),
              HasSubstr("line 5: \"zero\" is not a number"));
  EXPECT_THAT(error_of(with(one_facet, "      vertex 0 1 0\n", "")),
              HasSubstr("line 6: \"vertex\" was expected, not \"endloop\""));
  EXPECT_THAT(error_of(with(one_facet, "vertex 0 1 0", "vertex 0 1")),
              HasSubstr("line 6: \"vertex\" was expected"));
  EXPECT_THAT(error_of(with(one_facet, "endfacet", "endface")),
              HasSubstr("line 8: \"endfacet\" was expected, not \"endface\""));
  EXPECT_THAT(error_of(with(one_facet, "facet normal 0 0 1", "facet")),
              HasSubstr("line 2: \"facet normal\" was expected"));
}

TEST(Stl, ACountThatDoesNotFitTheSizeIsRefusedBeforeMemoryIsTaken) {
  std::string bytes(84, '\0');
  bytes.replace(80, 4, "\xff\xff\xff\xff");
  EXPECT_THAT(error_of(bytes), HasSubstr("a.stl:byte 80"));
  EXPECT_THAT(error_of(bytes), HasSubstr("4294967295 triangles"));
  const TemporaryFolder folder;
  ASSERT_TRUE(write_stl(tetrahedron(), folder / "t.stl"));
  const std::string good = *read_file(folder / "t.stl");
  for (std::size_t size = 0; size < good.size(); ++size) {
    EXPECT_FALSE(parse_stl(std::string_view(good).substr(0, size), "t").has_value()) << size;
  }
  EXPECT_FALSE(parse_stl(good + "x", "t").has_value());
}

TEST(Stl, ACornerOfABinaryFileThatIsNotFiniteIsNamedWithItsByte) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_stl(tetrahedron(), folder / "t.stl"));
  std::string bytes = *read_file(folder / "t.stl");
  const float infinite = std::numeric_limits<float>::infinity();
  std::memcpy(bytes.data() + 84 + 50 + 12, &infinite, sizeof infinite);
  EXPECT_THAT(error_of(bytes), HasSubstr("byte 146: a corner of triangle 1 is not finite"));
}

}  // namespace
}  // namespace skullstation
