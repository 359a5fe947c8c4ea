#include "reconstruction/approximation/face_estimate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "reconstruction/statistics/build_face_model.h"
#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using Eigen::Index;
using Eigen::VectorXd;
using testing::head_template;
using testing::people;
using testing::skull_template;

constexpr int training = 40;

/// Forty training subjects and ten that the model never saw, all aligned.
const std::vector<ModelSubject>& everybody() {
  static const auto all =
      aligned_population(skull_template(), head_template(), people(training + 10)).value();
  return all;
}

const FaceModel& model() {
  static const FaceModel built = [] {
    FaceModelOptions options;
    options.tissue.modes = 2;
    return build_face_model(
               skull_template(), head_template(),
               std::vector<ModelSubject>(everybody().begin(), everybody().begin() + training),
               options, "{}")
        .value();
  }();
  return built;
}

CaseSkull case_of(const ModelSubject& subject) {
  CaseSkull skull;
  skull.vertices = subject.skull;
  skull.observed = subject.skull_observed;
  skull.sd_mm = VectorXd::Constant(skull_template().boundary_count, 0.5);
  skull.belief =
      skull_belief(skull_template(), model().skull, subject.skull, subject.skull_observed);
  return skull;
}

double mean_error_mm(const FaceEstimate& face, const ModelSubject& truth) {
  const Points3 normals = vertex_normals({truth.head, head_template().triangles, {}, {}});
  return (face.head - truth.head).cwiseProduct(normals).rowwise().sum().cwiseAbs().mean();
}

FaceOptions coarse(TissueChoice tissue) {
  FaceOptions options;
  options.tissue = tissue;
  options.spheres.grid_mm = 2.0;
  options.spheres.smoothing_mm = 0.0;
  return options;
}

double mean_over_unseen(const std::function<FaceOptions(const ModelSubject&)>& options_of) {
  double sum = 0.0;
  for (int i = training; i < training + 10; ++i) {
    const ModelSubject& subject = everybody()[static_cast<std::size_t>(i)];
    const auto face = estimate_face(model(), case_of(subject), options_of(subject));
    sum += mean_error_mm(face.value(), subject) / 10.0;
  }
  return sum;
}

TEST(FaceEstimate, FactsBringTheFaceNearer) {
  const double from_skull =
      mean_over_unseen([](const ModelSubject&) { return coarse(TissueChoice::conditional); });
  const double with_facts = mean_over_unseen([](const ModelSubject& subject) {
    FaceOptions options = coarse(TissueChoice::conditional);
    options.facts = {subject.facts.male, subject.facts.age_years, subject.facts.body_mass_index};
    return options;
  });
  EXPECT_LT(with_facts, 0.7 * from_skull);
}

TEST(FaceEstimate, BandsHoldTheTruthAboutAsOftenAsTheySay) {
  int inside = 0;
  int all = 0;
  for (int i = training; i < training + 10; ++i) {
    const ModelSubject& subject = everybody()[static_cast<std::size_t>(i)];
    const FaceEstimate face =
        estimate_face(model(), case_of(subject), coarse(TissueChoice::conditional)).value();
    const Points3 normals = vertex_normals({subject.head, head_template().triangles, {}, {}});
    const VectorXd error = (face.head - subject.head).cwiseProduct(normals).rowwise().sum();
    for (Index v = 0; v < error.size(); ++v) {
      inside += std::abs(error[v]) <= face.band_mm[v] ? 1 : 0;
      ++all;
    }
  }
  EXPECT_GT(inside, 0.6 * all);
}

TEST(FaceEstimate, IsLessCertainWhereBoneWasMissing) {
  const CaseSkull whole = case_of(everybody()[training]);
  CaseSkull broken = whole;
  for (int v = 0; v < skull_template().boundary_count; ++v) {
    if (skull_template().vertices(v, 2) < 30.0) continue;
    broken.observed[static_cast<std::size_t>(v)] = false;
    broken.sd_mm[v] = 4.0;
  }
  const FaceEstimate face =
      estimate_face(model(), whole, coarse(TissueChoice::conditional)).value();
  const FaceEstimate less =
      estimate_face(model(), broken, coarse(TissueChoice::conditional)).value();
  for (Index v = 0; v < face.sd_mm.size(); ++v) {
    const double height = head_template().vertices(v, 2);
    if (height > 50.0) {
      EXPECT_NEAR(less.sd_mm[v], std::hypot(face.sd_mm[v], 4.0), 1e-9);
      EXPECT_NEAR(less.band_mm[v], std::hypot(face.band_mm[v], 1.2816 * 4.0), 1e-9);
    }
    if (height < 0.0) {
      EXPECT_EQ(less.sd_mm[v], face.sd_mm[v]);
      EXPECT_EQ(less.band_mm[v], face.band_mm[v]);
    }
  }
}

TEST(FaceEstimate, TissueGrowsWithTheBodyMassIndex) {
  const ModelSubject& subject = everybody()[training];
  const auto mean_depth = [&](double bmi) {
    FaceOptions options = coarse(TissueChoice::conditional);
    options.facts.body_mass_index = bmi;
    return estimate_face(model(), case_of(subject), options)->tissue_mm.mean();
  };
  EXPECT_NEAR((mean_depth(30.0) - mean_depth(20.0)) / 10.0, 0.5, 0.12);
}

TEST(FaceEstimate, VariationsPointTheWayTheFactsGo) {
  const ModelSubject& subject = everybody()[training + 1];
  const FaceEstimate face =
      estimate_face(model(), case_of(subject), coarse(TissueChoice::conditional)).value();
  const auto found = std::ranges::find(face.variations, "body mass index", &FaceVariation::name);
  ASSERT_NE(found, face.variations.end());
  const Points3 normals = vertex_normals({face.head, head_template().triangles, {}, {}});
  const double outwards = found->per_sd_mm.cwiseProduct(normals).rowwise().sum().mean();
  // Half a millimetre for each unit, and a standard deviation is about four.
  EXPECT_NEAR(outwards / found->sd_unit, 0.5, 0.15);
  EXPECT_EQ(face.variations.size(), static_cast<std::size_t>(model().tissue.mode_count()) + 1);
}

TEST(FaceEstimate, VariationsLieWhereFacesFittedAnewLie) {
  const CaseSkull skull = case_of(everybody()[training + 2]);
  FaceOptions options = coarse(TissueChoice::conditional);
  const FaceEstimate face = estimate_face(model(), skull, options).value();
  for (const FaceVariation& variation : face.variations) {
    EXPECT_GT(variation.per_sd_mm.rowwise().norm().mean(), 0.02) << variation.name;
    EXPECT_LT(variation.refit_gap_mm, 0.3) << variation.name;
  }
  options.variations = false;
  const FaceEstimate alone = estimate_face(model(), skull, options).value();
  EXPECT_TRUE(alone.variations.empty());
  EXPECT_EQ(alone.head, face.head);
}

TEST(FaceEstimate, FollowsDepthsThatAreKnown) {
  const CaseSkull skull = case_of(everybody()[training]);
  const FaceEstimate before =
      estimate_face(model(), skull, coarse(TissueChoice::conditional)).value();
  const Index at = 10;
  FaceOptions options = coarse(TissueChoice::conditional);
  KnownDepth known;
  known.bone.corners.setConstant(at);
  known.depth_mm = before.tissue_mm[at] + 3.0;
  known.sd_mm = 0.2;
  options.known_depths = {known};
  const FaceEstimate after = estimate_face(model(), skull, options).value();
  EXPECT_NEAR(after.tissue_mm[at], known.depth_mm, 0.4);
  // A ball's tissue is as thick everywhere: the other side follows, and so does the head.
  EXPECT_NEAR(after.tissue_mm.mean() - before.tissue_mm.mean(), 3.0, 0.6);
  const double grown = (after.head.rowwise().norm() - before.head.rowwise().norm()).mean();
  EXPECT_NEAR(grown, 3.0, 0.8);
  EXPECT_LT(after.tissue_sd_mm[at], before.tissue_sd_mm[at]);

  options.known_depths.front().depth_mm = -2.0;
  EXPECT_THAT(estimate_face(model(), skull, options).error().message(),
              ::testing::HasSubstr("no depth of soft tissue"));
}

TEST(FaceEstimate, WhatBoneDoesNotTellIsMarked) {
  const FaceEstimate face =
      estimate_face(model(), case_of(everybody()[training]), coarse(TissueChoice::population))
          .value();
  EXPECT_FALSE(face.from_bone[3]);  // the nose
  EXPECT_TRUE(face.from_bone[4]);
  EXPECT_GT(face.sd_mm.minCoeff(), 0.0);
}

TEST(FaceEstimate, IsTheSameForAnyNumberOfThreads) {
  const auto run = [&](int threads) {
    FaceOptions options = coarse(TissueChoice::conditional);
    options.threads = threads;
    return estimate_face(model(), case_of(everybody()[training]), options).value();
  };
  EXPECT_EQ(run(1).head, run(3).head);
}

TEST(FaceEstimate, RefusesFactsThatCantBe) {
  const auto error = [&](const PersonFacts& facts) {
    FaceOptions options;
    options.facts = facts;
    return estimate_face(model(), case_of(everybody()[0]), options).error();
  };
  EXPECT_EQ(error({.age_years = 7.0}).kind, ErrorKind::usage);
  EXPECT_THAT(error({.body_mass_index = 3.0}).message(), ::testing::HasSubstr("12 to 70"));
  EXPECT_THAT(error({.male = 0.5}).message(), ::testing::HasSubstr("male or female"));
  FaceOptions measured;
  measured.tissue = TissueChoice::measured;
  EXPECT_THAT(estimate_face(model(), case_of(everybody()[0]), measured).error().message(),
              ::testing::HasSubstr("0 depths"));
}

}  // namespace
}  // namespace skullstation
