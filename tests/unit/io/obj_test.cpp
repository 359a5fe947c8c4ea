#include "reconstruction/io/obj.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/unit/io/tetrahedron.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using skullstation::testing::tetrahedron;
using ::testing::HasSubstr;

const std::string square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";

std::string error_of(const std::string& text) {
  const auto mesh = parse_obj(text, "a.obj");
  EXPECT_FALSE(mesh.has_value());
  return mesh ? std::string() : mesh.error().message();
}

TEST(Obj, WhatIsWrittenIsReadBack) {
  const TemporaryFolder folder;
  TriangleMesh mesh = tetrahedron();
  mesh.normals = vertex_normals(mesh);
  mesh.colors.resize(4, 3);
  mesh.colors << 1, 2, 3, 4, 5, 6, 7, 8, 9, 253, 254, 255;
  ASSERT_TRUE(write_obj(mesh, folder / "t.obj"));
  const auto back = read_obj(folder / "t.obj");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->vertices, mesh.vertices);
  EXPECT_EQ(back->triangles, mesh.triangles);
  EXPECT_EQ(back->colors, mesh.colors);
  ASSERT_EQ(back->normals.rows(), 4);
  EXPECT_LT((back->normals - mesh.normals).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(Obj, AMeshWithoutNormalsAndColoursIsReadBack) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_obj(tetrahedron(), folder / "t.obj"));
  const auto back = read_obj(folder / "t.obj");
  ASSERT_TRUE(back) << back.error().message();
  EXPECT_EQ(back->triangles, tetrahedron().triangles);
  EXPECT_EQ(back->normals.rows(), 0);
  EXPECT_EQ(back->colors.rows(), 0);
}

TEST(Obj, PolygonsRelativeIndicesAndOtherProgramsStatements) {
  const auto mesh = parse_obj("# made elsewhere\r\nmtllib a.mtl\no skull\r\n" + square +
                                  "vt 0 0\nvn 0 0 1\nusemtl bone\ns off\n#comment\n"
                                  "f -4/1/1 -3/1/1 -2/1/1 -1/1/1\nl 1 2\n",
                              "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  Triangles expected(2, 3);
  expected << 0, 1, 2, 0, 2, 3;
  EXPECT_EQ(mesh->triangles, expected);
  EXPECT_EQ(mesh->normals, Points3(Eigen::RowVector3d(0, 0, 1).replicate(4, 1)));
}

TEST(Obj, NormalsOfASharpEdgeAreNotTakenForVertexNormals) {
  const auto mesh =
      parse_obj(square + "vn 0 0 1\nvn 0 1 0\nf 1//1 2//1 3//1\nf 1//2 3//2 4//2\n", "a");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->normals.rows(), 0);
}

TEST(Obj, EveryDefectIsNamedWithItsLine) {
  EXPECT_THAT(error_of(""), HasSubstr("a.obj:line 1: there are no vertices"));
  EXPECT_THAT(error_of("ply\n"), HasSubstr("line 1: \"ply\" is not a statement"));
  EXPECT_THAT(error_of("v 0 0\n"), HasSubstr("line 1: a vertex has 3 coordinates"));
  EXPECT_THAT(error_of("v 0 0 inf\n"), HasSubstr("line 1: a coordinate is not finite"));
  EXPECT_THAT(error_of("v 0 0 1e999\n"), HasSubstr("line 1: \"1e999\" is not a number"));
  EXPECT_THAT(error_of("v 0 0 0 0 0 2\n"), HasSubstr("colour 2 is not within 0..1"));
  EXPECT_THAT(error_of("vn 0 0\n"), HasSubstr("a normal has 3 coordinates"));
  EXPECT_THAT(error_of(square + "f 1 2\n"), HasSubstr("line 5: a face has 2 corners"));
  EXPECT_THAT(error_of(square + "f 1 2 5\n"), HasSubstr("line 5: \"5\" names none of the 4"));
  EXPECT_THAT(error_of(square + "f 0 1 2\n"), HasSubstr("\"0\" names none"));
  EXPECT_THAT(error_of(square + "f -5 1 2\n"), HasSubstr("\"-5\" names none"));
  EXPECT_THAT(error_of(square + "f 1 2 99999999999999999999\n"), HasSubstr("names none"));
  EXPECT_THAT(error_of(square + "f 1//1 2//1 3//1\n"), HasSubstr("none of the 0 normals"));
  EXPECT_THAT(error_of(square + "f 1 2 \\\n3\n"), HasSubstr("continued lines"));
}

}  // namespace
}  // namespace skullstation
