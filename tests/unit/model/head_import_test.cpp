#include "reconstruction/statistics/head_import.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/random.h"
#include "daemon/model/model_source.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/statistics/build_face_model.h"
#include "tests/support/temporary_folder.h"
#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;

TEST(MultiPieLandmarks, NamesThoseThatOurTemplateHas) {
  std::vector<int> vertices(68);
  for (int i = 0; i < 68; ++i) vertices[static_cast<std::size_t>(i)] = 100 + i;
  const auto landmarks = multi_pie_landmarks(vertices);
  ASSERT_TRUE(landmarks);
  const auto source = load_model(std::nullopt);
  ASSERT_TRUE(source) << source.error().message();
  for (const VertexLandmark& landmark : *landmarks) {
    EXPECT_TRUE(std::ranges::any_of(
        source->model.head_template.landmarks,
        [&](const TemplateLandmark& ours) { return ours.name == landmark.name; }))
        << landmark.name;
    if (landmark.name == "exocanthion right") {
      EXPECT_EQ(landmark.vertex, 136);
    }
  }
}

TEST(MultiPieLandmarks, AreSixtyEight) {
  const auto landmarks = multi_pie_landmarks({1, 2, 3});
  ASSERT_FALSE(landmarks);
  EXPECT_THAT(landmarks.error().message(), HasSubstr("3 vertices are not the 68"));
}

TEST(ImportHead, RefusesALandmarkThatIsNoVertex) {
  StatismoModel foreign;
  foreign.model.mean = Eigen::VectorXd::Zero(30);
  const auto imported =
      import_head({}, foreign, {.landmarks = {{"pronasale", 10}}, .seed = 1, .threads = 1});
  ASSERT_FALSE(imported);
  EXPECT_THAT(imported.error().message(), HasSubstr("is vertex 10 of a head of 10"));
}

TEST(WithHead, NothingIsKnownOfTheHeadBesidesTheSkull) {
  const FaceModel base = build_face_model(testing::skull_template(), testing::head_template(),
                                          testing::people(12), {}, "{}")
                             .value();
  ASSERT_TRUE(base.joint.index_of("head 1"));
  const FaceModel other = with_head(base, base.head);
  EXPECT_FALSE(other.joint.index_of("head 1"));
  ASSERT_TRUE(other.joint.index_of("tissue 1"));
  EXPECT_TRUE(other.validate());
  EXPECT_EQ(other.joint.covariance(*other.joint.index_of("skull 1"), *other.joint.index_of("male")),
            base.joint.covariance(*base.joint.index_of("skull 1"), *base.joint.index_of("male")));
}

/// Root mean square distance of the face's vertices from a foreign head.
double face_rms_mm(const HeadTemplate& head, const Points3& in_foreign_frame,
                   const TriangleMesh& foreign) {
  const TriangleBvh surface(foreign);
  double squares = 0.0;
  int count = 0;
  for (Eigen::Index v = 0; v < in_foreign_frame.rows(); ++v) {
    const HeadRegion region = head.region[static_cast<std::size_t>(v)];
    if (region == HeadRegion::neck || region == HeadRegion::scalp || region == HeadRegion::ears) {
      continue;
    }
    const double d = surface.closest(Eigen::Vector3d(in_foreign_frame.row(v))).distance_mm;
    squares += d * d;
    ++count;
  }
  return std::sqrt(squares / count);
}

TEST(ImportHead, TheIctHeadsMeanAndMembersAreReproduced) {
  const auto file = testing::real_data_folder() / "head-ict/ict_head.h5";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not here";
  const auto foreign = decode_statismo(read_file(file).value(), "ict_head.h5");
  ASSERT_TRUE(foreign) << foreign.error().message();
  const auto json = nlohmann::json::parse(
      read_file(testing::real_data_folder() / "head-ict/landmarks68.json").value());
  HeadImportOptions options;
  options.landmarks = multi_pie_landmarks(json["indices"].get<std::vector<int>>()).value();
  options.threads = 2;
  const auto source = load_model(std::nullopt);
  ASSERT_TRUE(source) << source.error().message();
  const auto imported = import_head(source->model, *foreign, options);
  ASSERT_TRUE(imported) << imported.error().message();

  const Similarity3 foreign_from_anatomical = imported->anatomical_from_foreign.inverse();
  Random random(7);
  for (int member = 0; member <= 20; ++member) {
    // Member 0 is the mean. A foreign shape, and ours whose places lie on it.
    Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(foreign->model.mode_count());
    if (member > 0) {
      for (double& c : coefficients) c = random.normal();
    }
    TriangleMesh shape;
    shape.vertices = shape_at(foreign->model, coefficients);
    shape.triangles = foreign->triangles;
    Points3 ours(source->model.head_template.vertices.rows(), 3);
    for (Eigen::Index v = 0; v < ours.rows(); ++v) {
      ours.row(v) = imported->anatomical_from_foreign *
                    imported->places[static_cast<std::size_t>(v)].position(shape.vertices);
    }
    // What our model makes of it: the nearest of its members.
    const Eigen::VectorXd of_modes =
        imported->model.modes.transpose() * (flattened(ours) - imported->model.mean);
    const Points3 member_of_ours =
        unflattened(imported->model.mean + imported->model.modes * of_modes);
    Points3 back = member_of_ours;
    for (Eigen::Index v = 0; v < back.rows(); ++v) {
      back.row(v) = foreign_from_anatomical * Eigen::Vector3d(member_of_ours.row(v));
    }
    EXPECT_LT(face_rms_mm(source->model.head_template, back, shape), 0.3) << "member " << member;
  }
}

}  // namespace
}  // namespace skullstation
