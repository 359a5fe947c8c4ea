#include "reconstruction/io/ply.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <bit>
#include <cstring>

#include "core/file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/io/tetrahedron.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using skullstation::testing::tetrahedron;
using ::testing::HasSubstr;

std::string ascii_header(int vertices, int faces) {
  return "ply\nformat ascii 1.0\nelement vertex " + std::to_string(vertices) +
         "\nproperty float x\nproperty float y\nproperty float z\nelement face " +
         std::to_string(faces) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string error_of(const std::string& bytes) {
  const auto mesh = parse_ply(bytes, "a.ply");
  EXPECT_FALSE(mesh.has_value());
  return mesh ? std::string() : mesh.error().message();
}

TEST(Ply, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tetrahedron();
  mesh.normals = vertex_normals(mesh);
  mesh.colors.resize(4, 3);
  mesh.colors << 1, 2, 3, 4, 5, 6, 7, 8, 9, 253, 254, 255;
  ASSERT_TRUE(write_ply(mesh, folder / "t.ply"));
  const auto back = read_ply(folder / "t.ply");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->triangles, mesh.triangles);
  EXPECT_EQ(back->colors, mesh.colors);
  EXPECT_LT((back->normals - mesh.normals).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Ply, AsciiPolygonsBecomeFans) {
  const auto mesh = parse_ply(ascii_header(4, 1) + "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  Triangles expected(2, 3);
  expected << 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(mesh->triangles, expected);
}

TEST(Ply, BigEndianAndUnknownElementsAreRead) {
  std::string bytes =
      "ply\nformat binary_big_endian 1.0\nelement camera 1\nproperty list uchar short trace\n"
      "element vertex 1\nproperty double x\nproperty double y\nproperty double z\n"
      "property ushort quality\nend_header\n";
  bytes += std::string("\x02\x00\x01\x00\x02", 5);
  for (const double value : {1.5, -2.0, 3.25}) {
    auto raw = std::bit_cast<std::array<char, 8>>(value);
    if (std::endian::native == std::endian::little) std::reverse(raw.begin(), raw.end());
    bytes.append(raw.data(), raw.size());
  }
  bytes += std::string("\x01\x02", 2);
  const auto mesh = parse_ply(bytes, "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(Eigen::RowVector3d(mesh->vertices.row(0)), Eigen::RowVector3d(1.5, -2.0, 3.25));
}

TEST(Ply, EveryDefectIsNamedWithItsPlace) {
  EXPECT_THAT(error_of("solid cube\n"), HasSubstr("a.ply:line 1: not a PLY file"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\n"), HasSubstr("no end_header"));
  EXPECT_THAT(error_of("ply\nend_header\n"), HasSubstr("format line is missing"));
  EXPECT_THAT(error_of("ply\nformat ascii 1.0\nend_header\n"), HasSubstr("no \"vertex\" element"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 nan 0\n3 0 1 2\n"),
              HasSubstr("vertex 2 is not finite"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n"),
              HasSubstr("a.ply:line 13: face 0 names vertex 3 of 3"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 1 0\n3 0 -1 2\n"),
              HasSubstr("names vertex -1"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 1 0\n2 0 1\n"),
              HasSubstr("has 2 corners"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 1 zero\n3 0 1 2\n"),
              HasSubstr("line 12: a number was expected"));
  EXPECT_THAT(error_of(ascii_header(3, 1) + "0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n7\n"),
              HasSubstr("more data than the header announces"));
}

TEST(Ply, AbsurdCountsAreRefusedBeforeMemoryIsTaken) {
  EXPECT_THAT(error_of(ascii_header(2000000000, 1) + "0 0 0\n"), HasSubstr("too short"));
  EXPECT_THAT(error_of("ply\nformat binary_little_endian 1.0\nelement vertex 99999999999999\n"
                       "property float x\nproperty float y\nproperty float z\nend_header\n"),
              HasSubstr("too short"));
}

TEST(Ply, EveryTruncationOfABinaryFileIsAnError) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_ply(tetrahedron(), folder / "t.ply"));
  const std::string bytes = *read_file(folder / "t.ply");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_FALSE(parse_ply(std::string_view(bytes).substr(0, size), "t").has_value()) << size;
  }
}

TEST(Ply, AMissingFileIsNamed) {
  const auto mesh = read_ply("/nowhere/skull.ply");
  ASSERT_FALSE(mesh);
  EXPECT_THAT(mesh.error().message(), HasSubstr("/nowhere/skull.ply: can't be read"));
}

TEST(Ply, TheRealSkullIsRead) {
  const auto path = skullstation::testing::real_data_folder() / "skull-bodyparts3d" / "skull.ply";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "real data is not here: " << path;
  const auto mesh = read_ply(path);
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->vertices.rows(), 221014);
  EXPECT_EQ(mesh->triangles.rows(), 441936);
}

}  // namespace
}  // namespace skullstation
