#include "reconstruction/statistics/build_face_model.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using testing::head_template;
using testing::people;
using testing::skull_template;

TEST(AlignedPopulation, TakesPosesAwayAndKeepsSize) {
  const auto aligned = aligned_population(skull_template(), head_template(), people(30)).value();
  Points3 mean = Points3::Zero(skull_template().vertices.rows(), 3);
  for (const ModelSubject& subject : aligned) mean += subject.skull / 30.0;
  EXPECT_LT((mean - skull_template().vertices).rowwise().norm().maxCoeff(), 2.5);
  // What is left along the axes is size: the ratio of widths of skull and head stays.
  for (const ModelSubject& subject : aligned) {
    const double skull_width = subject.skull.col(0).maxCoeff() - subject.skull.col(0).minCoeff();
    const double head_width = subject.head.col(0).maxCoeff() - subject.head.col(0).minCoeff();
    EXPECT_NEAR(head_width - skull_width, 2.0 * subject.tissue_mm[0], 2.0) << subject.name;
    EXPECT_LT(std::abs(subject.skull.row(skull_template().boundary_count).norm()), 1.0);
  }
}

TEST(AlignedPopulation, NamesTheSubjectThatDoesNotFit) {
  auto subjects = people(8);
  subjects[3].skull.conservativeResize(10, 3);
  EXPECT_EQ(aligned_population(skull_template(), head_template(), subjects).error().where,
            "subject P3");
  subjects = people(8);
  subjects[5].head(2, 1) = std::nan("");
  EXPECT_THAT(aligned_population(skull_template(), head_template(), subjects).error().message(),
              HasSubstr("subject P5: a fitted vertex is not a number"));
}

TEST(CompleteSkulls, FillsWhatWasCroppedAsTheOthersAre) {
  auto aligned = aligned_population(skull_template(), head_template(), people(24)).value();
  ModelSubject& cropped = aligned[7];
  const Points3 truth = cropped.skull;
  for (int v = 0; v < skull_template().boundary_count; ++v) {
    if (skull_template().vertices(v, 2) < 30.0) continue;
    cropped.skull_observed[static_cast<std::size_t>(v)] = false;
    cropped.skull.row(v) *= 0.8;  // nonsense where nothing was seen
  }
  const std::vector<ModelSubject> before = aligned;
  complete_skulls(skull_template(), aligned);
  EXPECT_LT((aligned[7].skull - truth).rowwise().norm().maxCoeff(), 1.5);
  EXPECT_EQ(aligned[6].skull, before[6].skull);
}

TEST(BuildFaceModel, LearnsHowTheHeadFollowsFromTheSkull) {
  const auto model =
      build_face_model(skull_template(), head_template(), people(40), {}, "{}").value();
  EXPECT_TRUE(model.validate());
  EXPECT_EQ(model.joint.subjects, 40);
  EXPECT_TRUE(model.joint.index_of("body mass index"));
  EXPECT_TRUE(model.joint.index_of("skull 1"));
  EXPECT_TRUE(model.joint.index_of("tissue 1"));
  EXPECT_EQ(model.tissue.count.minCoeff(), 40);
  EXPECT_NEAR(tissue_at(model.tissue, Eigen::VectorXd::Zero(1)).mean(), 8.0, 0.8);
  ASSERT_EQ(model.bands.front().region, "all");
  EXPECT_GT(model.bands.front().factor, 0.5);
  EXPECT_LT(model.bands.front().factor, 3.0);
}

TEST(LeaveOneOut, TheSkullTellsMuchAndTheBodyMassIndexTheRest) {
  const auto aligned = aligned_population(skull_template(), head_template(), people(40)).value();
  const auto tissue = population_tissue_model(skull_template(), aligned).value();
  const auto left = leave_one_out(skull_template(), head_template(), aligned, tissue).value();
  ASSERT_EQ(left.size(), 40U);
  double mean = 0.0;
  double skull = 0.0;
  double full = 0.0;
  double mean_tissue = 0.0;
  double skull_tissue = 0.0;
  double full_tissue = 0.0;
  int inside = 0;
  int all = 0;
  for (const LeftOut& subject : left) {
    mean += subject.mean.head_mm.cwiseAbs().mean() / 40.0;
    skull += subject.given_skull.head_mm.cwiseAbs().mean() / 40.0;
    full += subject.given_all.head_mm.cwiseAbs().mean() / 40.0;
    mean_tissue += subject.mean.tissue_mm / 40.0;
    skull_tissue += subject.given_skull.tissue_mm / 40.0;
    full_tissue += subject.given_all.tissue_mm / 40.0;
    for (Index v = 0; v < subject.given_skull.head_mm.size(); ++v) {
      inside +=
          std::abs(subject.given_all.head_mm[v]) < 1.2816 * subject.given_all.head_sd_mm[v] ? 1 : 0;
      ++all;
    }
  }
  EXPECT_LT(skull, 0.85 * mean);
  EXPECT_LT(full, 0.6 * skull);
  // These skulls tell nothing of the tissue upon them, and nothing is read into them.
  EXPECT_LT(skull_tissue, 1.06 * mean_tissue);
  EXPECT_LT(full_tissue, 0.3 * mean_tissue);
  // An 80 % band of a Gaussian holds about 80 %.
  EXPECT_GT(inside, 0.6 * all);
}

TEST(BuildFaceModel, RefusesTooFewAndTheSameSubjectTwice) {
  const auto error = [](std::vector<ModelSubject> subjects) {
    return build_face_model(skull_template(), head_template(), std::move(subjects), {}, "{}")
        .error()
        .message();
  };
  EXPECT_THAT(error(people(5)), HasSubstr("5 subjects are too few"));
  auto twice = people(9);
  twice[8] = twice[2];
  twice[8].name = "Q";
  EXPECT_THAT(error(twice), HasSubstr("subject Q: is the same as subject P2"));
}

TEST(BuildFaceModel, WorksWithoutCovariates) {
  auto subjects = people(12);
  for (ModelSubject& subject : subjects) {
    subject.facts.male.reset();
    subject.facts.age_years.reset();
    subject.facts.body_mass_index.reset();
  }
  const auto model = build_face_model(skull_template(), head_template(), subjects, {}, "{}");
  ASSERT_TRUE(model) << model.error().message();
  EXPECT_FALSE(model->joint.index_of("male"));
}

}  // namespace
}  // namespace skullstation
