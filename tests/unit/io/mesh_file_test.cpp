#include "reconstruction/io/mesh_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tests/support/temporary_folder.h"
#include "tests/unit/io/tetrahedron.h"

namespace skullstation {
namespace {

using skullstation::testing::TemporaryFolder;
using skullstation::testing::tetrahedron;
using ::testing::HasSubstr;

TEST(MeshFile, TheExtensionTellsTheFormatInEitherCase) {
  const TemporaryFolder folder;
  for (const char* name : {"a.ply", "a.obj", "a.stl", "A.PLY", "A.Obj", "A.STL"}) {
    ASSERT_TRUE(write_mesh(tetrahedron(), folder / name)) << name;
    const auto mesh = read_mesh(folder / name);
    ASSERT_TRUE(mesh) << mesh.error().message();
    EXPECT_EQ(mesh->triangles.rows(), 4);
  }
  EXPECT_TRUE(write_mesh(tetrahedron(), folder / "a.glb"));
}

TEST(MeshFile, UnknownExtensionsAreNamedWithTheKnownOnes) {
  const auto in = read_mesh("skull.fbx");
  ASSERT_FALSE(in);
  EXPECT_THAT(in.error().message(), HasSubstr(".ply, .obj or .stl"));
  const auto out = write_mesh(tetrahedron(), "skull");
  ASSERT_FALSE(out);
  EXPECT_EQ(out.error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace skullstation
