#include "reconstruction/phantom/phantom_ct.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/isosurface.h"
#include "reconstruction/phantom/phantom_ct_distance.h"
#include "reconstruction/phantom/phantom_ct_scanner.h"
#include "reconstruction/phantom/tissue_teeth.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

class Ball final : public ImplicitSolid {
 public:
  Ball(const Vector3d& center, double radius_mm) : center_(center), radius_mm_(radius_mm) {}
  double distance_mm(const Vector3d& p) const override { return (p - center_).norm() - radius_mm_; }
  Eigen::AlignedBox3d bounds() const override {
    const Vector3d reach = Vector3d::Constant(radius_mm_);
    return {center_ - reach, center_ + reach};
  }
  std::unique_ptr<ImplicitSolid> near_ball(const Vector3d&, double, double) const override {
    return std::make_unique<Ball>(center_, radius_mm_);
  }

 private:
  Vector3d center_;
  double radius_mm_;
};

TriangleMesh ball(const Vector3d& center, double radius_mm) {
  return isosurface(Ball(center, radius_mm), {.cell_mm = 0.6, .threads = 1});
}

const TissueMap& tissue() {
  static const TissueMap map(2);
  return map;
}

constexpr double kSkinRadius_mm = 17.0;
constexpr double kBoneRadius_mm = 11.0;
const Vector3d kCenter_mm(3.0, -5.0, 7.0);

/// A ball of bone in a ball of muscle: its canonical place is deep in the neck.
PhantomBody ball_in_ball() {
  PhantomBody body;
  body.bone = ball(kCenter_mm, kBoneRadius_mm);
  body.skin = ball(kCenter_mm, kSkinRadius_mm);
  body.canonical_from_patient = [](const Vector3d&) {
    const Vector3d neck(25, 25, -90);
    return CanonicalPlace{neck, neck};
  };
  return body;
}

PhantomCtOptions quiet() {
  PhantomCtOptions options;
  options.spacing_mm = Vector3d::Constant(0.6);
  options.margin_mm = 4.0;
  options.noise_sd_hu = 0.0;
  options.threads = 2;
  return options;
}

/// Distance from the centre at which the volume passes through `iso` along a direction, marching
/// inwards from the outside with trilinear interpolation.
double radius_at(const Volume& volume, const Vector3d& direction, double iso) {
  const auto value = [&](double r) {
    const Vector3d voxel = volume.grid.voxel_from_patient(kCenter_mm + r * direction);
    const Eigen::Vector3i cell = voxel.array().floor().cast<int>();
    const Vector3d part = voxel - cell.cast<double>();
    double sum = 0.0;
    for (int c = 0; c < 8; ++c) {
      const Eigen::Vector3i step(c & 1, c >> 1 & 1, c >> 2);
      const Eigen::Vector3i at = cell + step;
      double weight = 1.0;
      for (int k = 0; k < 3; ++k) weight *= step[k] == 1 ? part[k] : 1.0 - part[k];
      sum += weight * volume.at(at.x(), at.y(), at.z());
    }
    return sum;
  };
  double r = kSkinRadius_mm + 3.0;
  while (r > 0.5 && value(r) < iso) r -= 0.01;
  return r;
}

TEST(VoxelDistances, OfABallAreExactInTheBandAndSignedEverywhere) {
  VoxelGrid grid;
  grid.size = {50, 44, 30};
  grid.spacing_mm = {0.8, 0.9, 1.3};
  grid.direction = Eigen::AngleAxisd(0.3, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  grid.origin_mm = kCenter_mm - grid.direction * Vector3d(20, 20, 20);
  const auto distances = voxel_distances(ball(kCenter_mm, 12.0), grid, 2.0, 2);
  ASSERT_TRUE(distances) << distances.error().message();
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i) {
        const Vector3d p = grid.patient_from_voxel(Vector3d(i, j, k));
        const double exact = (p - kCenter_mm).norm() - 12.0;
        const double found = distances->distance_mm[grid.index(i, j, k)];
        if (std::abs(exact) > 0.02) {
          ASSERT_EQ(found < 0.0, exact < 0.0);
        }
        ASSERT_NEAR(found, std::clamp(exact, -2.0, 2.0), 0.02);
      }
    }
  }
}

TEST(VoxelDistances, TwoBallsThatOverlapAreOneSolid) {
  TriangleMesh two = ball({-3, 0, 0}, 8.0);
  const TriangleMesh other = ball({4, 0, 0}, 8.0);
  const int first = static_cast<int>(two.vertices.rows());
  two.vertices.conservativeResize(first + other.vertices.rows(), 3);
  two.vertices.bottomRows(other.vertices.rows()) = other.vertices;
  const Eigen::Index triangles = two.triangles.rows();
  two.triangles.conservativeResize(triangles + other.triangles.rows(), 3);
  two.triangles.bottomRows(other.triangles.rows()) = (other.triangles.array() + first).matrix();
  VoxelGrid grid;
  grid.size = {33, 25, 25};
  grid.origin_mm = {-16, -12, -12};
  const auto distances = voxel_distances(two, grid, 1.5, 1);
  ASSERT_TRUE(distances) << distances.error().message();
  EXPECT_LT(distances->distance_mm[grid.index(16, 12, 12)], 0.0F);  // in both
  EXPECT_LT(distances->distance_mm[grid.index(8, 12, 12)], 0.0F);   // in one
  EXPECT_GT(distances->distance_mm[grid.index(2, 12, 12)], 0.0F);
}

TEST(VoxelDistances, RefuseAnOpenSurface) {
  TriangleMesh open = ball({0, 0, 0}, 8.0);
  open.triangles.conservativeResize(open.triangles.rows() / 2, 3);
  VoxelGrid grid;
  grid.size = {25, 25, 25};
  grid.origin_mm = {-12, -12, -12};
  const auto distances = voxel_distances(open, grid, 1.5, 1);
  ASSERT_FALSE(distances);
  EXPECT_EQ(distances.error().kind, ErrorKind::bad_input);
}

TEST(VoxelDistances, RefuseASurfaceTurnedInsideOut) {
  TriangleMesh inverted = ball({0, 0, 0}, 8.0);
  inverted.triangles.col(0).swap(inverted.triangles.col(1));
  VoxelGrid grid;
  grid.size = {25, 25, 25};
  grid.origin_mm = {-12, -12, -12};
  EXPECT_FALSE(voxel_distances(inverted, grid, 1.5, 1));
}

TEST(PhantomCt, ItsIsosurfacesMeetTheGivenSurfaces) {
  const auto volume = phantom_ct(ball_in_ball(), tissue(), quiet());
  ASSERT_TRUE(volume) << volume.error().message();
  for (const Vector3d& d : {Vector3d(1, 0, 0), Vector3d(0, -1, 0), Vector3d(0, 0, 1),
                            Vector3d(1, 1, 1), Vector3d(-2, 1, 0.5)}) {
    EXPECT_NEAR(radius_at(*volume, d.normalized(), -200.0), kSkinRadius_mm, 0.1);
    EXPECT_NEAR(radius_at(*volume, d.normalized(), 600.0), kBoneRadius_mm, 0.1);
  }
}

TEST(PhantomCt, HasTheValuesOfItsTissues) {
  const auto volume = phantom_ct(ball_in_ball(), tissue(), quiet());
  ASSERT_TRUE(volume);
  const auto at = [&](double r) {
    const Vector3d voxel =
        volume->grid.voxel_from_patient(kCenter_mm + r * Vector3d::UnitX()).array().round();
    return volume->at(static_cast<int>(voxel.x()), static_cast<int>(voxel.y()),
                      static_cast<int>(voxel.z()));
  };
  EXPECT_NEAR(at(0.0), 450, 5);     // trabecular
  EXPECT_NEAR(at(9.9), 1500, 160);  // cortical
  EXPECT_NEAR(at(13.5), 55, 15);    // muscle
  EXPECT_EQ(volume->at(0, 0, 0), -1000);
}

TEST(PhantomCt, NoiseHasItsSpreadAndTheSameBytesForAnyNumberOfThreads) {
  PhantomCtOptions options = quiet();
  options.spacing_mm = Vector3d::Constant(1.0);
  options.margin_mm = 12.0;
  options.noise_sd_hu = 20.0;
  options.seed = 4;
  options.threads = 1;
  const auto one = phantom_ct(ball_in_ball(), tissue(), options);
  options.threads = 3;
  const auto three = phantom_ct(ball_in_ball(), tissue(), options);
  ASSERT_TRUE(one && three);
  EXPECT_EQ(one->hu, three->hu);
  options.seed = 5;
  EXPECT_NE(phantom_ct(ball_in_ball(), tissue(), options)->hu, one->hu);
  // Air: 2 of the slices of the margin.
  double sum = 0.0;
  const int count = one->grid.size.x() * one->grid.size.y() * 2;
  for (int i = 0; i < count; ++i) {
    const double off = std::max(one->hu[static_cast<std::size_t>(i)] + 1000.0, -24.0);
    sum += off > 0.0 ? off : 0.0;  // what lies below is cut off at -1024
  }
  EXPECT_NEAR(sum / count, 20.0 / std::sqrt(2.0 * 3.14159265), 0.4);
}

TEST(PhantomCt, CropsBedMetalAndPaddingDoWhatTheySay) {
  PhantomCtOptions options = quiet();
  options.spacing_mm = Vector3d::Constant(1.0);
  const auto plain = phantom_ct(ball_in_ball(), tissue(), options);
  options.cropped_calvaria_mm = 5.0;
  options.cropped_nose_mm = 3.0;
  const auto cropped = phantom_ct(ball_in_ball(), tissue(), options);
  ASSERT_TRUE(plain && cropped);
  EXPECT_NEAR(plain->grid.size.z() - cropped->grid.size.z(), 9, 1);
  EXPECT_NEAR(cropped->grid.origin_mm.y() - plain->grid.origin_mm.y(), 7.0, 1e-9);

  options = quiet();
  options.spacing_mm = Vector3d::Constant(1.0);
  options.margin_mm = 50.0;
  options.head_rest = true;
  options.table = true;
  options.metal_mm = {kCenter_mm};
  options.padding_hu = -2000;
  const auto volume = phantom_ct(ball_in_ball(), tissue(), options);
  ASSERT_TRUE(volume);
  const auto near = [&](const Vector3d& p) {
    const Eigen::Vector3i v =
        volume->grid.voxel_from_patient(p).array().round().matrix().cast<int>();
    return volume->at(v.x(), v.y(), v.z());
  };
  const double back_mm = kCenter_mm.y() + kSkinRadius_mm;
  EXPECT_NEAR(near({kCenter_mm.x(), back_mm + 8.0, -20}), -150, 10);  // shell
  EXPECT_NEAR(near({kCenter_mm.x(), back_mm + 39.0, -20}), -60, 10);  // table
  EXPECT_EQ(near(kCenter_mm), 3071);
  EXPECT_EQ(volume->at(0, 0, 0), -2000);
  // Streaks only in the metal's slices.
  double here = 0.0;
  double elsewhere = 0.0;
  for (int i = 0; i < 40; ++i) {
    const Vector3d p =
        kCenter_mm + Vector3d(25.0 * std::cos(0.16 * i), 25.0 * std::sin(0.16 * i), 0);
    if (p.y() > kCenter_mm.y()) continue;  // there lies the head rest
    here = std::max(here, std::abs(near(p) + 1000.0));
    elsewhere = std::max(elsewhere, std::abs(near(p + Vector3d(0, 0, 14)) + 1000.0));
  }
  EXPECT_GT(here, 100.0);
  EXPECT_LT(elsewhere, 5.0);
}

TEST(PhantomCt, ObliqueGridsSeeTheSameBody) {
  PhantomCtOptions options = quiet();
  options.direction = Eigen::AngleAxisd(0.4, Vector3d(1, -1, 2).normalized()).toRotationMatrix();
  const auto volume = phantom_ct(ball_in_ball(), tissue(), options);
  ASSERT_TRUE(volume);
  EXPECT_NEAR(radius_at(*volume, Vector3d(0, 1, 0), -200.0), kSkinRadius_mm, 0.1);
  EXPECT_NEAR(radius_at(*volume, Vector3d(0, 1, 0), 600.0), kBoneRadius_mm, 0.1);
}

TEST(PhantomCt, RefusesOptionsOutOfRangeAndEmptySurfaces) {
  const auto refused = [](const std::function<void(PhantomCtOptions&)>& change) {
    PhantomCtOptions options = quiet();
    change(options);
    const auto volume = phantom_ct(ball_in_ball(), tissue(), options);
    return !volume && volume.error().kind == ErrorKind::usage;
  };
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.spacing_mm.z() = 0.1; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.spacing_mm.x() = NAN; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.direction *= 2.0; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.margin_mm = -1.0; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.blur_fwhm_mm = 6.0; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.noise_sd_hu = -1.0; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.streak_hu = 1e4; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.cropped_nose_mm = 101.0; }));
  EXPECT_TRUE(refused([](PhantomCtOptions& o) { o.cropped_calvaria_mm = 60.0; }));

  PhantomBody empty = ball_in_ball();
  empty.bone = {};
  const auto volume = phantom_ct(empty, tissue(), quiet());
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().kind, ErrorKind::bad_input);
}

TEST(PhantomCt, StopsWhenAsked) {
  std::stop_source source;
  source.request_stop();
  Progress progress;
  progress.stop = source.get_token();
  const auto volume = phantom_ct(ball_in_ball(), tissue(), quiet(), progress);
  ASSERT_FALSE(volume);
  EXPECT_EQ(volume.error().kind, ErrorKind::cancelled);
}

TEST(ToothHu, LowerTeethAreFoundWhereTheOpenJawHasThem) {
  const Rigid3 open = mandible_opening(8.0);
  const Vector3d upper(8.0, -93.0, -36.5);
  const Vector3d lower(3.0, -92.0, -46.5);
  const Vector3d behind(0.0, -60.0, -40.0);
  EXPECT_EQ(tooth_hu(upper, {}, 0.5), 2500.0);
  EXPECT_EQ(tooth_hu(upper, {}, 2.0), 1700.0);
  EXPECT_EQ(tooth_hu(lower, {}, 0.5), 2500.0);
  EXPECT_FALSE(tooth_hu(behind, {}, 0.5));
  EXPECT_EQ(tooth_hu(upper, open.inverse(), 0.5), 2500.0);
  EXPECT_EQ(tooth_hu(open * lower, open.inverse(), 0.5), 2500.0);
  EXPECT_FALSE(tooth_hu(open * lower, {}, 0.5));
  EXPECT_FALSE(tooth_hu(lower, open.inverse(), 0.5));  // between the open jaws
}

TEST(TissueMap, KnowsTheOrgansOfTheHead) {
  EXPECT_EQ(tissue().at({0, 15, 60}), TissueKind::brain);
  EXPECT_EQ(tissue().at({31.5, -66, 20}), TissueKind::eye);
  EXPECT_EQ(tissue().at({-31.5, -66, 20}), TissueKind::eye);
  EXPECT_EQ(tissue().at({0, -16, -60}), TissueKind::air);       // pharynx
  EXPECT_EQ(tissue().at({29.5, -64, -10.5}), TissueKind::air);  // maxillary sinus
  EXPECT_EQ(tissue().at({50, -35, -35}), TissueKind::muscle);   // masseter
  EXPECT_EQ(tissue().at({42, -62, -30}), TissueKind::fat);      // cheek
  EXPECT_EQ(tissue().at({0, 200, 0}), TissueKind::skin);
  EXPECT_STREQ(to_string(TissueKind::brain), "brain");
}

}  // namespace
}  // namespace skullstation
