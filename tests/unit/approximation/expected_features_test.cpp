#include "reconstruction/approximation/expected_features.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "reconstruction/anatomy/feature_rules.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

/// A skull of nothing but landmarks, each a vertex of its own.
struct Landmarks {
  SkullTemplate skull;
  CaseSkull fitted;

  explicit Landmarks(const std::vector<std::pair<std::string, Vector3d>>& places) {
    const auto count = static_cast<int>(places.size());
    skull.boundary_count = count;
    fitted.vertices.resize(count, 3);
    for (int i = 0; i < count; ++i) {
      const auto& [name, place] = places[static_cast<std::size_t>(i)];
      fitted.vertices.row(i) = place;
      skull.landmarks.push_back({name, {Eigen::Vector3i::Constant(i), Vector3d::UnitX()}});
    }
    skull.vertices = fitted.vertices;
    fitted.sd_mm = Eigen::VectorXd::Zero(count);
  }
};

/// Bones in one plane: 50 mm from nasion to acanthion, 40 mm from rhinion to subspinale.
Landmarks nose_bones() {
  return Landmarks({{"nasion", {0, -80, 50}},
                    {"acanthion", {0, -80, 0}},
                    {"rhinion", {0, -80, 30}},
                    {"subspinale", {0, -80, -10}},
                    {"prosthion", {0, -80, -20}},
                    {"porion left", {60, 0, 0}},
                    {"porion right", {-60, 0, 0}}});
}

/// A head of six vertices: two of the nose, and two triangles of the left eye's lid that make a
/// square of 20 mm before the orbit.
HeadTemplate small_head() {
  HeadTemplate head;
  head.vertices.resize(6, 3);
  head.vertices << 0, -100, 10,  //
      0, -110, 5,                //
      20, -80, 20,               //
      40, -80, 20,               //
      40, -80, 40,               //
      20, -80, 40;
  head.triangles.resize(2, 3);
  head.triangles << 2, 3, 4, 2, 4, 5;
  head.region = {HeadRegion::nose, HeadRegion::nose, HeadRegion::eyes,
                 HeadRegion::eyes, HeadRegion::eyes, HeadRegion::eyes};
  return head;
}

TEST(ExpectedFeatures, PutTheTipOfTheNoseWhereRynnDoes) {
  const Landmarks bones = nose_bones();
  const auto features = expected_features(bones.skull, bones.fitted);
  ASSERT_EQ(features.size(), 2U) << "no orbit is there";
  EXPECT_NEAR(features[0].expected_mm, 0.83 * 40.0 - 3.5, 1e-9);
  EXPECT_TRUE(features[0].way.isApprox(-Vector3d::UnitY()));
  EXPECT_NEAR(features[1].expected_mm, 0.9 * 50.0 - 2.0, 1e-9);
  EXPECT_TRUE(features[1].way.isApprox(-Vector3d::UnitZ()));
  EXPECT_EQ(features[0].sd_mm, kNoseRule_sd_mm);
  const HeadTemplate head = small_head();
  EXPECT_NEAR(*feature_mm(features[0], head, head.vertices), 30.0, 1e-9) << "the foremost vertex";
  EXPECT_NEAR(*feature_mm(features[1], head, head.vertices), 45.0, 1e-9);
}

TEST(ExpectedFeatures, AreAsUncertainAsTheBonesThatTheyStartFrom) {
  Landmarks bones = nose_bones();
  bones.fitted.sd_mm.setConstant(2.0);
  const auto features = expected_features(bones.skull, bones.fitted);
  EXPECT_NEAR(features[0].sd_mm, std::sqrt(kNoseRule_sd_mm * kNoseRule_sd_mm + 4 * 4.0), 1e-9);
}

TEST(ExpectedFeatures, PutTheLidBeforeTheOrbit) {
  const Landmarks bones({{"dacryon left", {10, -70, 28}},
                         {"ectoconchion left", {48, -60, 28}},
                         {"mid-supraorbitale left", {30, -75, 45}},
                         {"mid-infraorbitale left", {30, -75, 10}}});
  const auto features = expected_features(bones.skull, bones.fitted);
  ASSERT_EQ(features.size(), 1U);
  EXPECT_NEAR(features[0].expected_mm, 18.0, 1e-9) << "cornea and lid";
  EXPECT_NEAR(features[0].origin.x(), 29.0 + 2.3, 1e-9) << "to the side";
  EXPECT_NEAR(features[0].origin.z(), 27.5 + 1.4, 1e-9) << "and up";
  const HeadTemplate head = small_head();
  EXPECT_NEAR(*feature_mm(features[0], head, head.vertices), 20.0, 1e-9);
  Points3 elsewhere = head.vertices;
  elsewhere.col(0).array() += 100.0;
  EXPECT_FALSE(feature_mm(features[0], head, elsewhere)) << "the line misses the lid";
}

TEST(ExpectedFeatures, NeedTheirLandmarks) {
  const Landmarks bones({{"nasion", {0, -80, 50}}});
  EXPECT_TRUE(expected_features(bones.skull, bones.fitted).empty());
  EXPECT_FALSE(expected_mouth_width_mm(bones.skull, bones.fitted));
}

TEST(ExpectedFeatures, TheMouthIsWiderThanTheCaninesAreApart) {
  const Landmarks bones(
      {{"supra-canine left", {19, -80, 0}}, {"supra-canine right", {-19, -80, 0}}});
  EXPECT_NEAR(*expected_mouth_width_mm(bones.skull, bones.fitted), 38.0 / 0.758, 1e-9);
}

/// The rule for how far forward the tip of the nose lies: 29.7 mm, where small_head() has 30.
std::vector<ExpectedFeature> forward_only() {
  const Landmarks bones = nose_bones();
  const auto features = expected_features(bones.skull, bones.fitted);
  return {features.begin(), features.begin() + 1};
}

TEST(ExpectedFeatures, DrawTheHeadAsFarAsTheyAreCertain) {
  const HeadTemplate head = small_head();
  constexpr double sd_mm = 4.0;
  const Points3 drawn =
      drawn_to_features(head, head.vertices, Eigen::VectorXd::Constant(6, sd_mm), forward_only());
  const double gain = sd_mm * sd_mm / (sd_mm * sd_mm + kNoseRule_sd_mm * kNoseRule_sd_mm);
  EXPECT_NEAR(drawn(1, 1), -110.0 + 0.3 * gain, 1e-9) << "the tip";
  EXPECT_EQ(drawn(1, 0), 0.0);
  EXPECT_EQ(drawn(1, 2), 5.0);
  const double along = (drawn(0, 1) + 100.0) / (drawn(1, 1) + 110.0);
  EXPECT_GT(along, 0.4) << "11 mm away, half of it";
  EXPECT_LT(along, 0.9);
  EXPECT_TRUE(drawn.bottomRows(4).isApprox(head.vertices.bottomRows(4))) << "the lids are far away";
}

TEST(ExpectedFeatures, LeaveAHeadThatIsCertain) {
  const HeadTemplate head = small_head();
  EXPECT_EQ(drawn_to_features(head, head.vertices, Eigen::VectorXd::Zero(6), forward_only()),
            head.vertices);
}

TEST(ExpectedFeatures, DoNotMoveSkinOverBone) {
  HeadTemplate head = small_head();
  head.region[0] = HeadRegion::face;
  const Points3 drawn =
      drawn_to_features(head, head.vertices, Eigen::VectorXd::Constant(6, 4.0), forward_only());
  EXPECT_EQ(drawn.row(0), head.vertices.row(0));
  EXPECT_GT(drawn(1, 1), -110.0);
}

}  // namespace
}  // namespace skullstation
