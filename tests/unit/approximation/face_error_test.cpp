#include "reconstruction/approximation/face_error.h"

#include <gtest/gtest.h>

namespace skullstation {
namespace {

TriangleMesh plane_at_zero() {
  TriangleMesh skin;
  skin.vertices.resize(3, 3);
  skin.vertices << -100.0, -100.0, 0.0, 100.0, -100.0, 0.0, 0.0, 200.0, 0.0;
  skin.triangles.resize(1, 3);
  skin.triangles << 0, 1, 2;
  return skin;
}

TEST(FaceError, CountsTheFaceAndNotEarsScalpAndNeck) {
  HeadTemplate head_template;
  head_template.region = {HeadRegion::face, HeadRegion::nose,  HeadRegion::lips,
                          HeadRegion::ears, HeadRegion::scalp, HeadRegion::neck};
  Points3 head = Points3::Zero(6, 3);
  head.col(2) << 1.0, -2.0, 6.0, 30.0, 30.0, 30.0;
  const FaceError error = face_error(head_template, head, Eigen::VectorXd::Constant(6, 2.5),
                                     plane_at_zero(), /*threads=*/1);
  EXPECT_EQ(error.vertices, 3);
  EXPECT_DOUBLE_EQ(error.mean_mm, 3.0);
  EXPECT_DOUBLE_EQ(error.over_bone_mean_mm, 1.0);
  EXPECT_DOUBLE_EQ(error.features_mean_mm, 4.0);
  EXPECT_DOUBLE_EQ(error.within_band, 2.0 / 3.0);
}

TEST(FaceError, OfATemplateWithoutFaceIsEmpty) {
  HeadTemplate head_template;
  head_template.region = {HeadRegion::neck};
  const FaceError error = face_error(head_template, Points3::Zero(1, 3), Eigen::VectorXd::Zero(1),
                                     plane_at_zero(), /*threads=*/1);
  EXPECT_EQ(error.vertices, 0);
  EXPECT_EQ(error.mean_mm, 0.0);
}

}  // namespace
}  // namespace skullstation
