// From a CT scan to a subject's folder, and every mistake that a scan can have.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/volume/dicom_writer.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/volume/analytic_head.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::AnalyticHead;
using skullstation::testing::ProcessResult;
using skullstation::testing::real_data_folder;
using skullstation::testing::skullstation_cli;
using skullstation::testing::TemporaryFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

class CtImport : public ::testing::Test {
 protected:
  ProcessResult import(const fs::path& scan, std::vector<std::string> more = {}) {
    more.insert(more.begin(), {"ct", "import", scan, "--out", subject(), "--edge-mm", "4"});
    return skullstation_cli(more);
  }
  fs::path subject() const { return folder_ / "subject"; }
  nlohmann::json json(const char* name) const {
    return nlohmann::json::parse(read_file(subject() / name).value());
  }
  /// A head of 3 mm voxels as a DICOM series; the writer makes the folder.
  void write_head(const fs::path& series, const DicomWriteOptions& options = {}) {
    const auto written = write_dicom_series(AnalyticHead{}.volume(3.0), series, options);
    ASSERT_TRUE(written) << written.error().message();
  }
  /// Nothing may be left of an import that failed.
  void expect_nothing_written() const {
    EXPECT_FALSE(fs::exists(subject()));
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_THAT(entry.path().filename().string(), Not(HasSubstr("unfinished")));
    }
  }

  TemporaryFolder folder_;
};

TEST_F(CtImport, ASeriesBecomesASubject) {
  DicomWriteOptions identity;
  identity.patient_name = "Somebody^Made Up";
  write_head(folder_ / "ct", identity);
  const auto result = import(folder_ / "ct", {"--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* name : {"skull.ply", "skin.ply"}) {
    const auto mesh = read_ply(subject() / name);
    ASSERT_TRUE(mesh) << mesh.error().message();
    EXPECT_TRUE(topology_of(*mesh).is_closed_manifold()) << name;
    EXPECT_EQ(mesh->normals.rows(), mesh->vertices.rows()) << name;
  }
  const auto printed = nlohmann::json::parse(result.out);
  const auto quality = json("quality.json");
  EXPECT_EQ(printed["skin"], quality["skin"]);
  EXPECT_EQ(quality["skin"]["components"], 1);
  EXPECT_EQ(quality["warnings"][0]["warning"], "thick slices");
  const auto about = json("subject.json");
  EXPECT_EQ(about["thresholds"]["bone_hu"], 600);
  EXPECT_EQ(about["scan"]["spacing_mm"], nlohmann::json({3.0, 3.0, 3.0}));
  EXPECT_EQ(about["options"]["edge_mm"], 4.0);
  EXPECT_FALSE(about.contains("identity"));
  for (const char* name : {"subject.json", "report.html", "quality.json"}) {
    EXPECT_THAT(read_file(subject() / name).value(), Not(HasSubstr("Somebody"))) << name;
  }
  const std::string report = read_file(subject() / "report.html").value();
  EXPECT_THAT(report, AllOf(HasSubstr("slices of 3.00 mm"), HasSubstr("Thin bone"),
                            HasSubstr("data:image/jpeg;base64,"), Not(HasSubstr("://"))));
}

TEST_F(CtImport, TheIdentityIsKeptOnRequest) {
  DicomWriteOptions identity;
  identity.patient_name = "Somebody^Made Up";
  write_head(folder_ / "ct", identity);
  const auto result = import(folder_ / "ct", {"--keep-identity"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(json("subject.json")["identity"]["name"].get<std::string>(), HasSubstr("Somebody"));
}

TEST_F(CtImport, TheSameBytesForAnyNumberOfThreads) {
  write_head(folder_ / "ct");
  std::vector<std::string> hashes;
  for (const char* threads : {"1", "3"}) {
    ASSERT_EQ(import(folder_ / "ct", {"--threads", threads}).exit_code, 0);
    std::string all;
    for (const char* name :
         {"skull.ply", "skin.ply", "quality.json", "subject.json", "report.html"}) {
      all += read_file(subject() / name).value();
    }
    hashes.push_back(sha256_hex(all));
    fs::remove_all(subject());
  }
  EXPECT_EQ(hashes[0], hashes[1]);
}

TEST_F(CtImport, OptionsReachTheSurfaces) {
  write_head(folder_ / "ct");
  ASSERT_EQ(import(folder_ / "ct", {"--no-crop", "--bone-hu", "500"}).exit_code, 0);
  EXPECT_TRUE(json("quality.json")["crop_z_mm"].is_null());
  EXPECT_EQ(json("subject.json")["thresholds"]["bone_hu"], 500);
  EXPECT_EQ(json("subject.json")["options"]["crop"], false);
}

TEST_F(CtImport, ASubjectIsNeverOverwritten) {
  write_head(folder_ / "ct");
  fs::create_directory(subject());
  ASSERT_TRUE(write_file_durably(subject() / "notes.txt", "mine"));
  const auto result = import(folder_ / "ct");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("is there already"));
  EXPECT_EQ(read_file(subject() / "notes.txt").value(), "mine");
  EXPECT_EQ(std::distance(fs::directory_iterator(subject()), {}), 1);
}

TEST_F(CtImport, AFolderWithoutDicomIsNamed) {
  fs::create_directory(folder_ / "empty");
  const auto empty = import(folder_ / "empty");
  EXPECT_EQ(empty.exit_code, 3);
  EXPECT_THAT(empty.err, AllOf(HasSubstr((folder_ / "empty").string()), HasSubstr("DICOM")));
  const auto none = import(folder_ / "nowhere");
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_THAT(none.err, HasSubstr("does not exist"));
  expect_nothing_written();
}

TEST_F(CtImport, AMissingSliceIsNamedByItsPosition) {
  write_head(folder_ / "ct");
  fs::remove(folder_ / "ct" / "IM_0010.dcm");
  const auto result = import(folder_ / "ct");
  EXPECT_EQ(result.exit_code, 3);
  // The tenth slice lies 27 mm above the first, at -140.
  EXPECT_THAT(result.err, AllOf(HasSubstr("a slice is missing"), HasSubstr("-113.00) mm")));
  expect_nothing_written();
}

TEST_F(CtImport, OfTwoSeriesOneIsChosen) {
  DicomWriteOptions options;
  options.series_number = 4;
  write_head(folder_ / "ct" / "a", options);
  options.series_number = 5;
  write_head(folder_ / "ct" / "b", options);
  const auto both = import(folder_ / "ct");
  EXPECT_EQ(both.exit_code, 3);
  EXPECT_THAT(both.err, AllOf(HasSubstr("2 CT series"), HasSubstr("--series")));
  expect_nothing_written();
  EXPECT_EQ(import(folder_ / "ct", {"--series", "5"}).exit_code, 0);
}

TEST_F(CtImport, ATruncatedSliceIsNamed) {
  write_head(folder_ / "ct");
  const fs::path slice = folder_ / "ct" / "IM_0007.dcm";
  fs::resize_file(slice, fs::file_size(slice) / 2);
  const auto result = import(folder_ / "ct", {"--json"});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("IM_0007.dcm"));
  EXPECT_TRUE(nlohmann::json::parse(result.out).contains("error")) << result.out;
  expect_nothing_written();
}

TEST_F(CtImport, WhatIsNoHeadIsToldApart) {
  Volume water = AnalyticHead{}.volume(3.0);
  for (std::size_t v = 0; v < water.hu.size(); ++v) water.hu[v] = v % 50 == 0 ? 0 : -1000;
  ASSERT_TRUE(write_dicom_series(water, folder_ / "ct"));
  const auto result = import(folder_ / "ct");
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("no head"));
  expect_nothing_written();
}

TEST_F(CtImport, UsageErrors) {
  EXPECT_EQ(skullstation_cli({"ct"}).exit_code, 2);
  EXPECT_EQ(skullstation_cli({"ct", "import"}).exit_code, 2);
  write_head(folder_ / "ct");
  for (const std::vector<std::string>& wrong : {std::vector<std::string>{"--bone-hu", "5000"},
                                                {"--edge-mm", "-1"},
                                                {"--length-unit", "ft"},
                                                {"--skin-hu", "300"}}) {
    EXPECT_EQ(import(folder_ / "ct", wrong).exit_code, 2) << wrong[0];
  }
  expect_nothing_written();
}

TEST_F(CtImport, TheRealHead) {
  const fs::path scan = real_data_folder() / "ct-head" / "ct-head.nii.gz";
  if (!fs::exists(scan)) GTEST_SKIP() << "real data is not here: " << scan;
  const auto result = import(scan);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto quality = json("quality.json");
  EXPECT_EQ(quality["skull"]["components"], 1);
  EXPECT_EQ(quality["skin"]["components"], 1);
  EXPECT_TRUE(quality["skin"]["closed_manifold"]);
}

}  // namespace
}  // namespace skullstation
