#include "reconstruction/photogrammetry/stereo_view.h"

#include <gtest/gtest.h>

#include <cmath>

namespace skullstation {
namespace {

Lens bent_lens() {
  return Lens::from_params(320, 240, LensModel::opencv,
                           {500, 505, 163, 118, -0.12, 0.05, 0.001, -0.0007});
}

/// Brightness that is a smooth function of the ray, whatever the lens does to the picture.
double pattern(const Eigen::Vector3d& ray) {
  return 128.0 + 60.0 * std::sin(30.0 * ray.x()) * std::cos(25.0 * ray.y());
}

Image8 seen_through(const Lens& lens) {
  Image8 image(lens.width, lens.height, 1);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      image.at(x, y) =
          static_cast<std::uint8_t>(std::lround(pattern(*lens.ray({x + 0.5, y + 0.5}))));
    }
  }
  return image;
}

Image8 disc_mask(const Lens& lens, double radius_px) {
  Image8 mask(lens.width, lens.height, 1);
  for (int y = 0; y < lens.height; ++y) {
    for (int x = 0; x < lens.width; ++x) {
      if (std::hypot(x - 120.0, y - 100.0) < radius_px) mask.at(x, y) = 255;
    }
  }
  return mask;
}

TEST(StereoView, UndoesDistortionToAGreyLevel) {
  const Lens lens = bent_lens();
  const auto view =
      make_stereo_view("photo", seen_through(lens), disc_mask(lens, 60.0), lens, Rigid3{}, 0);
  ASSERT_TRUE(view) << view.error().message();
  int compared = 0;
  for (int y = 0; y < view->camera.height; ++y) {
    for (int x = 0; x < view->camera.width; ++x) {
      if (view->mask.at(x, y) < 255) continue;
      EXPECT_NEAR(view->color.at(x, y), pattern(view->camera.ray(x + 0.5, y + 0.5)), 1.5);
      ++compared;
    }
  }
  EXPECT_NEAR(compared, 3.14159 * 60.0 * 60.0, 400.0);
  EXPECT_FALSE(view->cut_by_frame);
}

TEST(StereoView, IsCutToTheMask) {
  const Lens lens = bent_lens();
  const auto view =
      make_stereo_view("photo", seen_through(lens), disc_mask(lens, 30.0), lens, Rigid3{}, 0, 8);
  ASSERT_TRUE(view);
  EXPECT_LT(view->camera.width, 30 * 2 + 8 * 2 + 24);
  EXPECT_EQ(view->color.width, view->camera.width);
  EXPECT_EQ(view->mask.at(0, 0), 0);
}

TEST(StereoView, WithoutAMaskAllIsSpecimen) {
  const Lens lens = bent_lens();
  const auto view = make_stereo_view("photo", seen_through(lens), {}, lens, Rigid3{}, 0);
  ASSERT_TRUE(view);
  EXPECT_TRUE(view->cut_by_frame);
  EXPECT_EQ(view->mask.at(view->mask.width / 2, view->mask.height / 2), 255);
}

TEST(StereoView, RefusesWhatDoesNotBelongTogether) {
  const Lens lens = bent_lens();
  const Image8 photo = seen_through(lens);
  const auto other_size = make_stereo_view("a.png", photo, Image8(10, 10, 1), lens, Rigid3{}, 0);
  ASSERT_FALSE(other_size);
  EXPECT_EQ(other_size.error().where, "a.png");
  const auto black = make_stereo_view("b.png", photo, Image8(320, 240, 1), lens, Rigid3{}, 0);
  ASSERT_FALSE(black);
  EXPECT_NE(black.error().what.find("black"), std::string::npos);
  Lens folded = lens;
  folded.k1 = -30.0;
  folded.k2 = 0.0;
  const auto bad = make_stereo_view("c.png", photo, disc_mask(lens, 60.0), folded, Rigid3{}, 0);
  ASSERT_FALSE(bad);
  EXPECT_NE(bad.error().what.find("folds"), std::string::npos);
}

TEST(StereoView, HalvedPixelsAreMeansOfFour) {
  Image8 image(5, 4, 1);
  for (int i = 0; i < 20; ++i) image.pixels[i] = static_cast<std::uint8_t>(10 * i);
  const Image8 half = halved(image);
  ASSERT_EQ(half.width, 2);
  ASSERT_EQ(half.height, 2);
  EXPECT_EQ(half.at(0, 0), (0 + 10 + 50 + 60 + 2) / 4);
  EXPECT_EQ(half.at(1, 1), (120 + 130 + 170 + 180 + 2) / 4);
}

}  // namespace
}  // namespace skullstation
