#include "reconstruction/photogrammetry/masks.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "tests/unit/photogrammetry/poses_scene.h"

namespace skullstation {
namespace {

using skullstation::testing::make_pose_scene;
using skullstation::testing::PoseScene;
using ::testing::HasSubstr;

/// A warm ball on the board before a dark backdrop, as all cameras of a station see it.
struct BallScene {
  skullstation::testing::PoseSceneTruth truth;
  std::vector<Image8> photographs;
  std::vector<Image8> masks;

  std::vector<MaskView> views() const {
    std::vector<MaskView> result;
    Rigid3 table_from_board;
    table_from_board.translation = {1.5, -1.1, 0.0};
    for (std::size_t i = 0; i < photographs.size(); ++i) {
      result.push_back({&photographs[i], small_lens(), truth.camera_from_table[i],
                        truth.camera_from_table[i] * table_from_board});
    }
    return result;
  }
  /// Of the station's angle of view, without distortion.
  Lens small_lens() const {
    return Lens::from_params(640, 480, LensModel::pinhole, {1120.0, 1120.0, 322.9, 238.4});
  }
};

struct Ball {
  Eigen::Vector3d middle{5.0, -3.0, 70.0};
  double radius_mm = 60.0;
  Eigen::Vector3d color{190.0, 170.0, 130.0};
};

void photograph(const Ball& ball, std::size_t view, Random& random, BallScene& scene) {
  const Lens lens = scene.small_lens();
  const Rigid3 table_from_camera = scene.truth.camera_from_table[view].inverse();
  const CharucoBoard& board = scene.truth.board;
  constexpr int px_per_square = 40;
  static const Image8 print = draw_board(board, px_per_square);
  Image8 picture(lens.width, lens.height, 3);
  Image8 mask(lens.width, lens.height, 1);
  const Eigen::Vector3d eye = table_from_camera.translation;
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      const Eigen::Vector3d ray =
          (table_from_camera.rotation * lens.ray({x + 0.5, y + 0.5}).value()).normalized();
      Eigen::Vector3d color(22.0, 22.0, 24.0);
      const double along = (ball.middle - eye).dot(ray);
      const double nearest = (eye + along * ray - ball.middle).norm();
      if (nearest < ball.radius_mm) {
        const Eigen::Vector3d hit =
            eye + (along - std::sqrt(ball.radius_mm * ball.radius_mm - nearest * nearest)) * ray;
        const double light = (hit - ball.middle).normalized().dot(Eigen::Vector3d(0.3, 0.2, 0.93));
        color = ball.color * (0.6 + 0.4 * light);
        mask.at(x, y) = 255;
      } else if (ray.z() < 0.0) {
        const Eigen::Vector3d at = eye - ray * (eye.z() / ray.z());
        const double px_per_mm = px_per_square / board.square_mm;
        const auto column =
            static_cast<int>(std::floor((at.x() - 1.5 + 0.5 * board.width_mm()) * px_per_mm));
        const auto row =
            static_cast<int>(std::floor((0.5 * board.height_mm() - at.y() - 1.1) * px_per_mm));
        if (column >= 0 && row >= 0 && column < print.width && row < print.height) {
          color = Eigen::Vector3d::Constant(print.at(column, row) > 127 ? 190.0 : 25.0);
        }
      }
      for (int c = 0; c < 3; ++c) {
        picture.at(x, y, c) =
            static_cast<std::uint8_t>(std::clamp(color[c] + random.uniform(-3.5, 3.5), 0.0, 255.0));
      }
    }
  }
  scene.photographs.push_back(std::move(picture));
  scene.masks.push_back(std::move(mask));
}

BallScene make_ball_scene() {
  BallScene scene;
  PoseScene station;
  station.views_per_ring = 6;
  scene.truth = make_pose_scene(station);
  Random random(3);
  for (std::size_t i = 0; i < scene.truth.views.size(); ++i) photograph({}, i, random, scene);
  return scene;
}

const BallScene& ball_scene() {
  static const BallScene scene = make_ball_scene();
  return scene;
}

TEST(Masks, FindTheSpecimenAgainstBoardAndBackdrop) {
  const BallScene& scene = ball_scene();
  const auto masks = find_masks(scene.views(), &scene.truth.board);
  ASSERT_TRUE(masks) << masks.error().message();
  for (std::size_t i = 0; i < masks->size(); ++i) {
    EXPECT_GT(mask_overlap((*masks)[i].mask, scene.masks[i]), 0.9) << scene.truth.views[i].name;
    EXPECT_TRUE((*masks)[i].odd.empty()) << (*masks)[i].odd;
  }
}

TEST(Masks, AreTheSameForAnyNumberOfThreads) {
  const BallScene& scene = ball_scene();
  MaskOptions one;
  one.threads = 1;
  MaskOptions two;
  two.threads = 2;
  const auto a = find_masks(scene.views(), &scene.truth.board, one);
  const auto b = find_masks(scene.views(), &scene.truth.board, two);
  ASSERT_TRUE(a && b);
  for (std::size_t i = 0; i < a->size(); ++i) EXPECT_EQ((*a)[i].mask, (*b)[i].mask);
}

TEST(Masks, NameAViewInWhichTheSpecimenWasMoved) {
  BallScene scene = ball_scene();
  Ball moved;
  moved.middle += Eigen::Vector3d(-20.0, 20.0, 0.0);
  Random random(4);
  photograph(moved, 4, random, scene);
  std::swap(scene.photographs[4], scene.photographs.back());
  scene.photographs.pop_back();
  const auto masks = find_masks(scene.views(), &scene.truth.board);
  ASSERT_TRUE(masks) << masks.error().message();
  for (std::size_t i = 0; i < masks->size(); ++i) {
    if (i == 4) {
      EXPECT_THAT((*masks)[i].odd, HasSubstr("moved"));
    } else {
      EXPECT_TRUE((*masks)[i].odd.empty()) << i << ": " << (*masks)[i].odd;
    }
  }
}

TEST(Masks, NameAViewOfAnotherObject) {
  BallScene scene = ball_scene();
  Ball other;
  other.radius_mm = 35.0;
  other.middle.z() = 40.0;
  Random random(5);
  photograph(other, 7, random, scene);
  std::swap(scene.photographs[7], scene.photographs.back());
  scene.photographs.pop_back();
  const auto masks = find_masks(scene.views(), &scene.truth.board);
  ASSERT_TRUE(masks) << masks.error().message();
  for (std::size_t i = 0; i < masks->size(); ++i) {
    EXPECT_EQ((*masks)[i].odd.empty(), i != 7) << i << ": " << (*masks)[i].odd;
  }
}

TEST(Masks, SayWhyThereAreNone) {
  BallScene scene = ball_scene();
  const std::vector<MaskView> two(2);
  EXPECT_EQ(find_masks(two, nullptr).error().kind, ErrorKind::bad_input);
  for (Image8& picture : scene.photographs) std::ranges::fill(picture.pixels, std::uint8_t{10});
  const auto black = find_masks(scene.views(), &scene.truth.board);
  ASSERT_FALSE(black);
  EXPECT_EQ(black.error().kind, ErrorKind::no_result);
  EXPECT_THAT(black.error().message(), HasSubstr("no specimen"));
}

}  // namespace
}  // namespace skullstation
