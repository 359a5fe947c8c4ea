#include "daemon/case/case_folder.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/staged_folder.h"
#include "daemon/case/face_pictures.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/statistics/build_face_model.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using testing::head_template;
using testing::skull_template;

struct Example {
  FaceModel model;
  CaseSkull skull;
  FaceEstimate face;
  CaseSource source;
};

const Example& example() {
  static const Example made = [] {
    Example e;
    const auto people =
        aligned_population(skull_template(), head_template(), testing::people(20)).value();
    FaceModelOptions options;
    options.tissue.modes = 2;
    e.model = build_face_model(skull_template(), head_template(), people, options, "{}").value();
    e.skull.vertices = people[3].skull;
    e.skull.observed = people[3].skull_observed;
    e.skull.sd_mm = Eigen::VectorXd::Constant(skull_template().boundary_count, 0.5);
    e.skull.belief =
        skull_belief(skull_template(), e.model.skull, people[3].skull, e.skull.observed);
    e.skull.warnings = {"78 % of the skull's outside was observed; the rest was completed"};
    FaceOptions face_options;
    face_options.spheres.grid_mm = 3.0;
    face_options.facts.age_years = 40.0;
    e.face = estimate_face(e.model, e.skull, face_options).value();
    e.source.input = "skull.ply";
    e.source.input_sha256 = std::string(64, 'a');
    e.source.model_card = "Made of <balls>.";
    e.source.facts = face_options.facts;
    e.source.ancestry = "northern <X>";
    e.source.tissue = "depths foretold from the skull";
    e.source.program_version = "1.2.3";
    return e;
  }();
  return made;
}

Result<void> write(const std::filesystem::path& folder, int threads = 2) {
  return write_case_folder(example().model, example().skull, example().face, example().source,
                           folder, {.width_px = 48, .samples = 1, .threads = threads});
}

TEST(FaceVariants, AreThePapersGridAndLeanerAndFuller) {
  const std::vector<FaceVariant> variants = face_variants(example().face);
  ASSERT_EQ(variants.size(), 11U);
  EXPECT_EQ(variants[4].name, "mean");
  EXPECT_EQ(variants[4].head, example().face.head);
  EXPECT_EQ(variants[0].name, "tissue 1 -2, tissue 2 -2");
  EXPECT_EQ(variants[8].name, "tissue 1 +2, tissue 2 +2");
  EXPECT_LT((variants[0].head + variants[8].head - 2.0 * variants[4].head).cwiseAbs().maxCoeff(),
            1e-9);
  EXPECT_EQ(variants[9].name, "leaner");
  // Outwards is larger.
  EXPECT_GT(variants[10].head.norm(), variants[9].head.norm());
}

TEST(FaceVariants, MayBeTheMeanAloneOrAFinerGrid) {
  const std::vector<FaceVariant> alone = face_variants(example().face, 1);
  ASSERT_EQ(alone.size(), 3U);
  EXPECT_EQ(alone[0].name, "mean");
  const std::vector<FaceVariant> fine = face_variants(example().face, 5);
  ASSERT_EQ(fine.size(), 27U);
  EXPECT_EQ(fine[0].name, "tissue 1 -2, tissue 2 -2");
  EXPECT_EQ(fine[11].name, "tissue 1 -1");
  EXPECT_EQ(fine[12].name, "mean");
  EXPECT_EQ(fine[24].head, face_variants(example().face)[8].head);
}

TEST(CaseFolder, HoldsAllThatTheFormatNames) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write(folder / "case"));
  for (const char* name :
       {"skull_fitted.ply", "head.ply", "head.glb", "spheres.ply", "uncertainty.ply", "tissue.csv",
        "case.json", "report.html", "preview_front.png", "variants/mean.glb",
        "variants/tissue_1_+2_tissue_2_-2.glb", "variants/fuller.glb"}) {
    EXPECT_TRUE(std::filesystem::exists(folder / "case" / name)) << name;
  }
  const auto json = nlohmann::json::parse(read_file(folder / "case/case.json").value());
  EXPECT_EQ(json["format"], "skullstation-case/1");
  EXPECT_EQ(json["input"]["sha256"], std::string(64, 'a'));
  EXPECT_EQ(json["facts"]["age_years"], 40.0);
  EXPECT_TRUE(json["facts"]["male"].is_null());
  EXPECT_EQ(json["facts"]["ancestry"], "northern <X>");
  EXPECT_EQ(json["tissue_from"]["source"], "depths foretold from the skull");
  EXPECT_EQ(json["variations"].size(), 3U);
  EXPECT_EQ(json["tissue"].size(), 2U);
  EXPECT_EQ(json["warnings"].size(), 1U);
  const auto head = read_ply(folder / "case/head.ply");
  ASSERT_TRUE(head);
  EXPECT_LT((head->vertices - example().face.head).cwiseAbs().maxCoeff(), 1e-4);
}

TEST(CaseFolder, UncertaintyIsAPropertyOfEachVertex) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write(folder / "case"));
  const std::string ply = read_file(folder / "case/uncertainty.ply").value();
  EXPECT_NE(ply.find("property float sd_mm\nproperty float band80_mm\nproperty float from_bone\n"),
            std::string::npos);
  EXPECT_TRUE(parse_ply(ply, "uncertainty.ply"));
}

TEST(CaseFolder, ReportSaysWhatTheFaceIsAndWhatItIsNot) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write(folder / "case"));
  const std::string report = read_file(folder / "case/report.html").value();
  for (const char* words : {"an investigative aid, not an identification", "78 % of the skull",
                            "Made of &lt;balls&gt;.", "northern &lt;X&gt;", "It changes nothing",
                            "depths foretold from the skull", "40 years", "nasion", "1.2.3",
                            "data:image/jpeg;base64,"}) {
    EXPECT_NE(report.find(words), std::string::npos) << words;
  }
}

TEST(CaseFolder, IsTheSameBytesForAnyNumberOfThreads) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write(folder / "one", 1));
  ASSERT_TRUE(write(folder / "three", 3));
  for (const char* name : {"head.glb", "uncertainty.ply", "case.json", "report.html"}) {
    const bool same =
        read_file(folder / "one" / name).value() == read_file(folder / "three" / name).value();
    EXPECT_TRUE(same) << name;
  }
}

TEST(CaseFolder, NeverWritesOverAnother) {
  const testing::TemporaryFolder folder;
  ASSERT_TRUE(write(folder / "case"));
  EXPECT_EQ(write(folder / "case").error().kind, ErrorKind::usage);
}

TEST(ScalarColors, RunFromDarkToBrightAndAreGreyWhereUnknown) {
  const Colors colors = scalar_colors(Eigen::VectorXd{{0.0, 4.0, 9.0, std::nan("")}}, 0.0, 8.0);
  EXPECT_EQ(colors.row(0), (Eigen::Matrix<std::uint8_t, 1, 3>(68, 1, 84)));
  EXPECT_EQ(colors.row(1), (Eigen::Matrix<std::uint8_t, 1, 3>(33, 145, 140)));
  EXPECT_EQ(colors.row(2), (Eigen::Matrix<std::uint8_t, 1, 3>(253, 231, 37)));
  EXPECT_EQ(colors.row(3), (Eigen::Matrix<std::uint8_t, 1, 3>(150, 150, 150)));
}

}  // namespace
}  // namespace skullstation
