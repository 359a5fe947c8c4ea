// Whole registrations with coarse templates on coarse people, and every way an input can be wrong.

#include "reconstruction/registration/skull_registration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "core/random.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/registration/head_registration.h"
#include "reconstruction/templates/make_templates.h"
#include "tests/unit/registration/skull_pieces.h"

namespace skullstation {
namespace {

const SkullTemplate& skull_template() {
  static const SkullTemplate made =
      make_skull_template({.face_edge_mm = 5.0, .threads = 0}).value_or(SkullTemplate{});
  return made;
}

const HeadTemplate& head_template() {
  static const HeadTemplate made =
      make_head_template({.face_edge_mm = 6.0, .threads = 0}).value_or(HeadTemplate{});
  return made;
}

const Person& person() {
  static const Person made = PersonMaker(3.0, 0).make(draw_person(42), 0);
  return made;
}

HeadRegistrationOptions head_options() {
  HeadRegistrationOptions options;
  options.threads = 2;
  return options;
}

/// Where a vertex of the template belongs on this person.
Eigen::Vector3d on_person(int v) {
  const bool lower =
      bone_of(skull_template().region[static_cast<std::size_t>(v)]) == SkullBone::mandible;
  return person().bone.on_person(skull_template().vertices.row(v), lower);
}

Similarity3 some_pose() {
  Random random(11);
  return random_pose(random, 200.0);
}

TEST(SkullRegistration, AVeryLongFaceKeepsItsMandible) {
  // Between this face's teeth and its chin an unbent cranium leaves room for a whole small
  // mandible.
  const Person long_face = PersonMaker(2.0, 0).make(draw_person(mix(5000, 1)), 0);
  const auto fit = register_skull(skull_template(), long_face.skull, {.threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->quality.facial.mean_mm, 0.8);
  EXPECT_GT(fit->quality.mandible_observed_share, 0.8);
}

TEST(SkullRegistration, FindsAPersonsSkullInAnyPose) {
  const Similarity3 pose = some_pose();
  const auto fit = register_skull(skull_template(), moved(pose, person().skull), {.threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->quality.facial.mean_mm, 0.8) << "with a template of 5 mm";
  EXPECT_EQ(fit->quality.inverted_tetrahedra, 0);
  EXPECT_GT(fit->quality.least_scaled_volume, 0.0);
  EXPECT_GT(fit->quality.observed_share, 0.8);
  EXPECT_TRUE(fit->warnings.empty());
  double sum = 0.0;
  int count = 0;
  for (int v = 0; v < skull_template().boundary_count; ++v) {
    if (!skull_template().outer[static_cast<std::size_t>(v)]) continue;
    const Eigen::Vector3d truth = pose * on_person(v);
    sum += (fit->vertices.row(v).transpose() - truth).norm();
    ++count;
  }
  EXPECT_LT(sum / count, 3.0);
}

TEST(SkullRegistration, FollowsAFaceMuchLongerThanTheTemplates) {
  const Person far = PersonMaker(3.0, 0).make(draw_person(mix(1000, 2)), 0);
  const auto fit = register_skull(skull_template(), far.skull, {.threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->quality.facial.p95_mm, 2.0) << "its upper teeth lie 15 mm below the template's";
  EXPECT_GT(fit->quality.observed_share, 0.8);
}

TEST(SkullRegistration, GivesTheSameBytesForAnyNumberOfThreads) {
  const Similarity3 identity;
  const auto one =
      register_skull(skull_template(), person().skull, {.start = &identity, .threads = 1});
  const auto three =
      register_skull(skull_template(), person().skull, {.start = &identity, .threads = 3});
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->vertices, three->vertices);
}

TEST(SkullRegistration, TheVolumeEnergiesFitTooAndTurnNothingOver) {
  const Similarity3 identity;
  for (const SkullRegularizer regularizer :
       {SkullRegularizer::projected_volume, SkullRegularizer::volume}) {
    const auto fit = register_skull(skull_template(), person().skull,
                                    {.regularizer = regularizer, .start = &identity, .threads = 2});
    ASSERT_TRUE(fit) << fit.error().message();
    EXPECT_EQ(fit->quality.inverted_tetrahedra, 0);
    EXPECT_LT(fit->quality.facial.mean_mm, 1.5);
  }
}

TEST(SkullRegistration, SaysThatThereIsNoMandible) {
  const TriangleMesh cranium = skull_meshes(skull_solids(), 3.0, 0).cranium;
  const Similarity3 identity;
  const auto fit = register_skull(skull_template(), cranium, {.start = &identity, .threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->quality.mandible_observed_share, 0.2);
  EXPECT_THAT(fit->warnings, testing::Contains(testing::HasSubstr("no mandible")));
  EXPECT_EQ(fit->quality.inverted_tetrahedra, 0);
  for (int v = 0; v < skull_template().boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (bone_of(skull_template().region[at]) == SkullBone::mandible) {
      EXPECT_FALSE(fit->observed[at]);
    }
  }
}

TEST(SkullRegistration, WhatIsMissingIsNotObserved) {
  const TriangleMesh& whole = person().skull;
  const TriangleMesh right = submesh(whole, [&](Eigen::Index t) {
    return whole.vertices(whole.triangles.row(t), 0).maxCoeff() < 0.0;
  });
  const Similarity3 identity;
  const auto fit = register_skull(skull_template(), right, {.start = &identity, .threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  int right_seen = 0;
  int right_all = 0;
  int left_seen = 0;
  int left_all = 0;
  for (int v = 0; v < skull_template().boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (!skull_template().outer[at]) continue;
    const double x = skull_template().vertices(v, 0);
    if (x < -15.0) {
      ++right_all;
      right_seen += fit->observed[at] ? 1 : 0;
    }
    if (x > 15.0) {
      ++left_all;
      left_seen += fit->observed[at] ? 1 : 0;
    }
  }
  EXPECT_GT(right_seen, 0.8 * right_all);
  EXPECT_LT(left_seen, 0.05 * left_all);
}

TEST(SkullRegistration, FollowsAnOpenMandible) {
  SkullShape open;
  open.mandible_opening_deg = 12.0;
  const SkullMeshes meshes = skull_meshes(skull_solids(open), 3.0, 0);
  TriangleMesh input = meshes.cranium;
  const auto first = static_cast<int>(input.vertices.rows());
  input.vertices.conservativeResize(first + meshes.mandible.vertices.rows(), 3);
  input.vertices.bottomRows(meshes.mandible.vertices.rows()) = meshes.mandible.vertices;
  const Eigen::Index faces = input.triangles.rows();
  input.triangles.conservativeResize(faces + meshes.mandible.triangles.rows(), 3);
  input.triangles.bottomRows(meshes.mandible.triangles.rows()) =
      (meshes.mandible.triangles.array() + first).matrix();
  input.normals.resize(0, 3);
  const Similarity3 identity;
  const auto fit = register_skull(skull_template(), input, {.start = &identity, .threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  const Rigid3 opened = mandible_opening(12.0);
  for (const TemplateLandmark& landmark : skull_template().landmarks) {
    if (landmark.name != "menton" && landmark.name != "gnathion") continue;
    const Eigen::Vector3d truth = opened * landmark.place.position(skull_template().vertices);
    EXPECT_LT((landmark.place.position(fit->vertices) - truth).norm(), 4.0) << landmark.name;
  }
}

TEST(SkullRegistration, FindsTheSizeOfASkullOfUnknownUnit) {
  TriangleMesh metres = person().skull;
  metres.vertices *= 1e-3;
  const auto refused = register_skull(skull_template(), metres, {.threads = 2});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message(), testing::HasSubstr("metres"));
  const auto fit = register_skull(skull_template(), metres, {.unit_unknown = true, .threads = 2});
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_NEAR(fit->input_from_template.scale, 1e-3, 1.5e-4);
}

class RefusedInput : public testing::Test {
 protected:
  static void expect_refused(const TriangleMesh& mesh, const std::string& word) {
    const auto skull = register_skull(skull_template(), mesh, {.threads = 2});
    ASSERT_FALSE(skull);
    EXPECT_EQ(skull.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(skull.error().message(), testing::HasSubstr(word));
    const auto head = register_head(head_template(), mesh, head_options());
    ASSERT_FALSE(head);
    EXPECT_EQ(head.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(head.error().message(), testing::HasSubstr(word));
  }
};

TEST_F(RefusedInput, Empty) { expect_refused({}, "empty"); }

TEST_F(RefusedInput, ThreeVertices) {
  TriangleMesh mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 100, 0, 0, 0, 100, 0;
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  expect_refused(mesh, "3 vertices");
}

TEST_F(RefusedInput, Mirrored) {
  TriangleMesh mesh = person().skull;
  mesh.vertices.col(0) *= -1.0;
  expect_refused(mesh, "mirrored");
}

TEST_F(RefusedInput, NotANumber) {
  TriangleMesh mesh = person().skull;
  mesh.vertices(7, 1) = std::numeric_limits<double>::quiet_NaN();
  expect_refused(mesh, "not a number");
}

TEST_F(RefusedInput, MicrometresAndCentimetres) {
  TriangleMesh mesh = person().skull;
  mesh.vertices *= 0.1;
  expect_refused(mesh, "centimetres");
  mesh.vertices *= 1e4;
  expect_refused(mesh, "mm from corner to corner");
}

TEST(SkullRegistration, IsCancelledOnRequest) {
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const Similarity3 identity;
  const auto fit = register_skull(skull_template(), person().skull, {.start = &identity}, progress);
  ASSERT_FALSE(fit);
  EXPECT_EQ(fit.error().kind, ErrorKind::cancelled);
}

TEST(HeadRegistration, UsesLandmarksThatAreGiven) {
  const Similarity3 pose = some_pose();
  HeadRegistrationOptions options;
  options.threads = 2;
  for (const Landmark& landmark : person().face.landmarks) {
    options.landmarks.push_back({landmark.name, pose * landmark.position_mm});
  }
  const auto fit = register_head(head_template(), moved(pose, person().skin), options);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_LT(fit->quality.weighted_rms_mm, 0.6);
  options.landmarks.push_back({"third eye", Eigen::Vector3d::Zero()});
  const auto refused = register_head(head_template(), person().skin, options);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message(), testing::HasSubstr("third eye"));
}

TEST(HeadRegistration, FindsAPersonsHeadWithoutLandmarks) {
  const Similarity3 identity;
  HeadRegistrationOptions options = head_options();
  options.pose = &identity;
  const auto fit = register_head(head_template(), person().skin, options);
  ASSERT_TRUE(fit) << fit.error().message();
  EXPECT_GT(fit->quality.kept_share, 0.8);
  EXPECT_LT(fit->quality.facial.mean_mm, 1.0) << "with a template of 6 mm";
  const Points3 found = landmark_positions(head_template().landmarks, fit->vertices);
  for (std::size_t i = 0; i < head_template().landmarks.size(); ++i) {
    if (head_template().landmarks[i].name != "pronasale") continue;
    const auto truth =
        std::ranges::find(person().face.landmarks, "pronasale", &Landmark::name)->position_mm;
    EXPECT_LT((found.row(static_cast<Eigen::Index>(i)).transpose() - truth).norm(), 8.0);
  }
}

TEST(HeadRegistration, FindsTheFeaturesOfALongFace) {
  // By nearest points alone, what lies above is taken for chin and lips: 5.6 mm off.
  const Person far = PersonMaker(3.0, 0).make(draw_person(mix(1000, 12)), 0);
  const auto fit = register_head(head_template(), far.skin, head_options());
  ASSERT_TRUE(fit) << fit.error().message();
  double sum = 0.0;
  int count = 0;
  for (Eigen::Index v = 0; v < fit->vertices.rows(); ++v) {
    if (!is_facial(head_template().region[static_cast<std::size_t>(v)])) continue;
    const Eigen::Vector3d skin = far.face.face_from_canonical(head_template().vertices.row(v));
    const Eigen::Vector3d truth = far.bone.person_from_canonical(skin);
    sum += (fit->vertices.row(v).transpose() - truth).norm();
    ++count;
  }
  EXPECT_LT(sum / count, 4.5);
}

TEST(HeadRegistration, RefusesWeightsThatAreNotOneForEachVertex) {
  const Similarity3 identity;
  HeadRegistrationOptions options = head_options();
  options.pose = &identity;
  options.input_weight.assign(3, 1.0);
  const auto refused = register_head(head_template(), person().skin, options);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::usage);
}

}  // namespace
}  // namespace skullstation
