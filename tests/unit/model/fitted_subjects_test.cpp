#include "daemon/model/fitted_subjects.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "reconstruction/io/mesh_file.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

TriangleMesh triangle() {
  TriangleMesh mesh;
  mesh.vertices = 100.0 * Points3::Identity(3, 3);
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  return mesh;
}

Result<std::vector<SubjectFit>> fits(const TemporaryFolder& folder) {
  return fit_subjects(folder / "subjects", testing::skull_template(), testing::head_template(),
                      {folder / "fits", 1, 2});
}

TEST(FitSubjects, NamesEachThatCantBeFittedAndWhy) {
  const TemporaryFolder folder;
  for (const char* name : {"a_skin_alone", "b_skull_alone", "c_triangles", "d_damaged"}) {
    ASSERT_TRUE(make_writable_folder(folder / "subjects" / name));
  }
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/a_skin_alone/skin.ply"));
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/b_skull_alone/skull.ply"));
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/c_triangles/skull.ply"));
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/c_triangles/skin.ply"));
  ASSERT_TRUE(write_file_durably(folder / "subjects/d_damaged/skull.ply", "no mesh"));
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/d_damaged/skin.ply"));
  const auto done = fits(folder);
  ASSERT_TRUE(done) << done.error().message();
  ASSERT_EQ(done->size(), 4U);
  EXPECT_THAT((*done)[0].failure, HasSubstr("skull.ply"));
  EXPECT_THAT((*done)[1].failure, HasSubstr("skin.ply"));
  EXPECT_THAT((*done)[2].failure, HasSubstr("3 vertices"));
  EXPECT_THAT((*done)[3].failure, AllOf(HasSubstr("d_damaged"), HasSubstr("skull.ply")));
  EXPECT_EQ((*done)[3].subject.name, "d_damaged");
}

TEST(JudgeSubjects, NobodyCountsTwiceAndWhatIsMissingIsSaid) {
  const SkullTemplate& skull = testing::skull_template();
  std::vector<SubjectFit> fits(4);
  for (int i = 0; i < 4; ++i) {
    fits[static_cast<std::size_t>(i)].subject = testing::person(i);
    fits[static_cast<std::size_t>(i)].surfaces_sha256 = std::to_string(i);
  }
  fits[2].surfaces_sha256 = "0";                  // the same files
  fits[3].subject.skull = fits[1].subject.skull;  // other files of the same surfaces
  fits[1].subject.skull_observed.assign(fits[1].subject.skull_observed.size(), false);
  judge_subjects(skull, fits);
  EXPECT_EQ(fits[0].failure, "");
  EXPECT_EQ(fits[0].remark, "");
  EXPECT_EQ(fits[1].failure, "");
  EXPECT_THAT(fits[1].remark, AllOf(HasSubstr("0 % were observed"), HasSubstr("the others")));
  EXPECT_EQ(fits[2].failure, "is P0 again");
  EXPECT_EQ(fits[3].failure, "is P1 again");
}

TEST(FitSubjects, RefusesAFolderWithoutSubjects) {
  const TemporaryFolder folder;
  ASSERT_TRUE(make_writable_folder(folder / "subjects/notes"));
  const auto done = fits(folder);
  ASSERT_FALSE(done);
  EXPECT_THAT(done.error().message(), HasSubstr("holds no subject"));
}

TEST(FitSubjects, StopsWhenAsked) {
  const TemporaryFolder folder;
  ASSERT_TRUE(make_writable_folder(folder / "subjects/a"));
  ASSERT_TRUE(write_mesh(triangle(), folder / "subjects/a/skull.ply"));
  std::stop_source stop;
  stop.request_stop();
  Progress progress;
  progress.stop = stop.get_token();
  const auto done = fit_subjects(folder / "subjects", testing::skull_template(),
                                 testing::head_template(), {folder / "fits", 1, 1}, progress);
  ASSERT_FALSE(done);
  EXPECT_EQ(done.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
