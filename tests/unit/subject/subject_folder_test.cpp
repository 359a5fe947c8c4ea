#include "daemon/subject/subject_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/staged_folder.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/distance/shapes.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::sphere;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

/// Two balls in a small volume: enough to be written.
CtSurfaces small_surfaces() {
  CtSurfaces surfaces;
  surfaces.skull = sphere(8.0, 2);
  surfaces.skin = sphere(10.0, 2);
  surfaces.volume.grid.size = {24, 24, 24};
  surfaces.volume.grid.origin_mm.setConstant(-11.5);
  surfaces.volume.hu.assign(surfaces.volume.grid.count(), 0);
  surfaces.quality.findings.push_back({CtWarning::cropped_nose, "the nose is cut"});
  return surfaces;
}

TEST(SubjectFolder, HoldsItsFiles) {
  const TemporaryFolder folder;
  SubjectSource source;
  source.info.sex = "F";
  source.info.age_years = 31;
  source.options.bone_hu = 550;
  ASSERT_TRUE(write_subject_folder(small_surfaces(), source, folder / "s1/", 1));
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder / "s1")) {
    names.push_back(entry.path().filename());
  }
  EXPECT_THAT(names, ::testing::UnorderedElementsAre("skull.ply", "skin.ply", "quality.json",
                                                     "subject.json", "report.html"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder.path()), {}), 1);
  const auto about = nlohmann::json::parse(read_file(folder / "s1/subject.json").value());
  EXPECT_EQ(about["sex"], "F");
  EXPECT_EQ(about["age_years"], 31);
  EXPECT_EQ(about["thresholds"]["bone_hu"], 550);
  const auto quality = nlohmann::json::parse(read_file(folder / "s1/quality.json").value());
  EXPECT_EQ(quality["warnings"][0]["warning"], "cropped nose");
  EXPECT_THAT(read_file(folder / "s1/report.html").value(), HasSubstr("the nose is cut"));
}

TEST(SubjectFolder, IsWrittenIntoAnEmptyFolderButNotOverAnother) {
  const TemporaryFolder folder;
  fs::create_directory(folder / "empty");
  EXPECT_TRUE(write_subject_folder(small_surfaces(), {}, folder / "empty", 1));
  const auto again = write_subject_folder(small_surfaces(), {}, folder / "empty", 1);
  ASSERT_FALSE(again);
  EXPECT_EQ(again.error().kind, ErrorKind::usage);
  ASSERT_TRUE(write_file_durably(folder / "file", "x"));
  EXPECT_FALSE(check_new_folder(folder / "file"));
  EXPECT_FALSE(write_subject_folder(small_surfaces(), {}, folder / "file" / "s", 1));
}

TEST(SubjectFolder, ACancelledOneLeavesNothing) {
  const TemporaryFolder folder;
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const auto written = write_subject_folder(small_surfaces(), {}, folder / "s", 1, progress);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.error().kind, ErrorKind::cancelled);
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace skullstation
