#include "core/session/charuco_board.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "core/random.h"
#include "core/session/board_pattern.h"
#include "tests/unit/calibration/board_picture.h"

namespace skullstation {
namespace {

using testing::BoardPicture;
using testing::camera_looking_at;
using ::testing::HasSubstr;
using testing::photograph;
using testing::true_corners;

CharucoBoard small_board() {
  CharucoBoard board;
  board.squares_x = 8;
  board.squares_y = 6;
  return board;
}

/// A camera with noticeable distortion that sees the whole small board.
BoardPicture typical_picture(double elevation_deg = 55.0, double azimuth_deg = 25.0) {
  BoardPicture picture;
  picture.lens = Lens::from_params(800, 600, LensModel::opencv,
                                   {1400.0, 1395.0, 405.3, 297.1, -0.15, 0.08, 0.0006, -0.0004});
  picture.camera_from_board = camera_looking_at({0.0, 0.0}, 460.0, elevation_deg, azimuth_deg, 4.0);
  return picture;
}

struct Accuracy {
  int found = 0;
  double mean_px = 0.0;
  double max_px = 0.0;
};

Accuracy accuracy(const std::vector<BoardCorner>& corners, const BoardPicture& picture,
                  const CharucoBoard& board) {
  const auto truth = true_corners(picture, board);
  Accuracy result;
  for (const BoardCorner& corner : corners) {
    const double error = (corner.position_px - truth.at(corner.id)).norm();
    result.mean_px += error;
    result.max_px = std::max(result.max_px, error);
    ++result.found;
  }
  if (result.found > 0) result.mean_px /= result.found;
  return result;
}

Accuracy measure(const BoardPicture& picture, const CharucoBoard& board) {
  return accuracy(detect_board(photograph(picture, board), board), picture, board);
}

TEST(CharucoBoard, CornersCountFromThePagesTopLeftInAFrameCentredOnIt) {
  const CharucoBoard board = small_board();
  EXPECT_EQ(board.corner_count(), 7 * 5);
  EXPECT_TRUE(board.corner(0).isApprox(Eigen::Vector3d(-75.0, 50.0, 0.0)));
  EXPECT_TRUE(board.corner(6).isApprox(Eigen::Vector3d(75.0, 50.0, 0.0)));
  EXPECT_TRUE(board.corner(7).isApprox(Eigen::Vector3d(-75.0, 25.0, 0.0)));
  EXPECT_TRUE(board.corner(34).isApprox(Eigen::Vector3d(75.0, -50.0, 0.0)));
}

TEST(CharucoBoard, PageStartsBlackAndCarriesItsMarkersRowByRow) {
  const CharucoBoard board = small_board();
  const auto markers = board_markers(board);
  ASSERT_EQ(markers.size(), 24U);
  EXPECT_EQ(markers[0].column, 1);
  EXPECT_EQ(markers[0].row, 0);
  EXPECT_EQ(markers[4].column, 0);
  EXPECT_EQ(markers[4].row, 1);
  EXPECT_EQ(markers[4].id, 4);

  // 7 px a marker cell (5 bits + ring), 3 x 7 / 19 mm per cell: 175 px a square fits exactly.
  CharucoBoard exact = board;
  exact.square_mm = 25.0;
  exact.marker_mm = 21.0;
  const Image8 page = draw_board(exact, 175);
  ASSERT_EQ(page.width, 8 * 175);
  ASSERT_EQ(page.height, 6 * 175);
  EXPECT_EQ(page.at(87, 87), 0);             // top left square
  EXPECT_EQ(page.at(175 + 5, 5), 255);       // white margin of marker 0's square
  EXPECT_EQ(page.at(175 + 14 + 10, 24), 0);  // its black ring
  const MarkerDictionary dictionary = marker_dictionary(exact.dictionary).value();
  EXPECT_EQ(dictionary.bits, 5);
  for (const BoardMarker& marker : board_markers(exact)) {
    const Image8 bits = marker_bits(dictionary, marker.id);
    for (int y = 0; y < 5; ++y) {
      for (int x = 0; x < 5; ++x) {
        EXPECT_EQ(page.at(marker.column * 175 + 14 + (x + 1) * 21 + 10,
                          marker.row * 175 + 14 + (y + 1) * 21 + 10),
                  bits.at(x, y));
      }
    }
  }
}

TEST(CharucoBoard, FirstMarkerOf5x5IsThePublishedOne) {
  // DICT_5X5_1000's marker 0 as OpenCV prints it; 1 is white.
  const std::vector<std::string> rows = {"10100", "01011", "01100", "10101", "11100"};
  const Image8 bits = marker_bits(marker_dictionary("DICT_5X5_1000").value(), 0);
  std::vector<std::string> drawn;
  for (int y = 0; y < 5; ++y) {
    std::string row;
    for (int x = 0; x < 5; ++x) row += bits.at(x, y) == 0 ? '0' : '1';
    drawn.push_back(row);
  }
  EXPECT_EQ(drawn, rows);
}

TEST(CharucoBoard, DrawingKeepsTheMeanLevelAtAnyResolution) {
  // Sampled by area: however coarse, the ink's area stays what it is.
  const CharucoBoard board = small_board();
  const auto mean_level = [&](int pixels_per_square) {
    const Image8 page = draw_board(board, pixels_per_square);
    double sum = 0.0;
    for (const auto level : page.pixels) sum += level;
    return sum / static_cast<double>(page.pixels.size());
  };
  const double exact = mean_level(350);
  for (const int pixels : {7, 20, 33, 64}) EXPECT_NEAR(mean_level(pixels), exact, 0.2);
}

TEST(CharucoBoard, ImpossibleBoardsAreNamed) {
  const auto message = [](auto change) {
    CharucoBoard board;
    change(board);
    const auto valid = board.validate();
    EXPECT_FALSE(valid);
    return valid ? std::string() : valid.error().message();
  };
  EXPECT_TRUE(CharucoBoard{}.validate());
  EXPECT_THAT(message([](auto& b) { b.dictionary = "DICT_9X9"; }), HasSubstr("DICT_9X9"));
  EXPECT_THAT(message([](auto& b) { b.squares_x = 2; }), HasSubstr("2 x 14 squares"));
  EXPECT_THAT(message([](auto& b) { b.squares_y = -1; }), HasSubstr("14 x -1 squares"));
  EXPECT_THAT(message([](auto& b) { b.marker_mm = 25.0; }), HasSubstr("smaller than"));
  EXPECT_THAT(message([](auto& b) { b.marker_mm = 0.0; }), HasSubstr("larger than 0"));
  EXPECT_THAT(message([](auto& b) { b.square_mm = std::nan(""); }), HasSubstr("smaller than"));
  EXPECT_THAT(message([](auto& b) { b.dictionary = "DICT_5X5_50"; }),
              HasSubstr("need 98 markers, DICT_5X5_50 has 50"));
}

TEST(DetectBoard, FindsEveryCornerToAHundredthOfAPixel) {
  for (const double azimuth_deg : {0.0, 70.0, 135.0, 200.0, 290.0}) {
    const BoardPicture picture = typical_picture(60.0, azimuth_deg);
    const Accuracy a = measure(picture, small_board());
    EXPECT_EQ(a.found, 35) << azimuth_deg;
    EXPECT_LT(a.mean_px, 0.01) << azimuth_deg;
    EXPECT_LT(a.max_px, 0.03) << azimuth_deg;
  }
}

TEST(DetectBoard, AccurateWithNoiseAndBlur) {
  for (const double blur_px : {0.4, 1.0, 2.0}) {
    BoardPicture picture = typical_picture();
    picture.blur_px = blur_px;
    picture.noise_sd = 3.0;
    const Accuracy a = measure(picture, small_board());
    EXPECT_EQ(a.found, 35) << blur_px;
    EXPECT_LT(a.mean_px, 0.03) << blur_px;
    EXPECT_LT(a.max_px, 0.1) << blur_px;
  }
}

TEST(DetectBoard, AccurateInGrazingViews) {
  for (const double elevation_deg : {30.0, 20.0, 15.0}) {
    BoardPicture picture = typical_picture(elevation_deg, 15.0);
    picture.lens = Lens::from_params(1200, 500, LensModel::opencv,
                                     {2100.0, 2100.0, 600.0, 250.0, -0.1, 0.0, 0.0, 0.0});
    picture.noise_sd = 2.0;
    const Accuracy a = measure(picture, small_board());
    EXPECT_EQ(a.found, 35) << elevation_deg;
    EXPECT_LT(a.mean_px, 0.03) << elevation_deg;
    EXPECT_LT(a.max_px, 0.15) << elevation_deg;
  }
}

TEST(DetectBoard, StrongDistortionDoesNotMatter) {
  for (const double k1 : {-0.45, 0.4}) {
    BoardPicture picture = typical_picture(70.0, 10.0);
    picture.lens.k1 = k1;
    picture.lens.fx = picture.lens.fy = 800.0;
    picture.camera_from_board = camera_looking_at({0.0, 0.0}, 240.0, 70.0, 10.0);
    const Accuracy a = measure(picture, small_board());
    EXPECT_GE(a.found, 30) << k1;
    EXPECT_LT(a.mean_px, 0.03) << k1;
  }
}

TEST(DetectBoard, FindsSmallBoards) {
  BoardPicture picture = typical_picture();
  picture.camera_from_board = camera_looking_at({0.0, 0.0}, 1500.0, 60.0, 20.0);
  picture.noise_sd = 2.0;
  const Accuracy a = measure(picture, small_board());
  EXPECT_EQ(a.found, 35);
  EXPECT_LT(a.mean_px, 0.03);
}

TEST(DetectBoard, SpecimenInTheMiddleHidesItsCornersAndSpoilsNoOther) {
  CharucoBoard board;  // 14 x 14, as on the turntable
  BoardPicture picture = typical_picture(35.0, 20.0);
  picture.camera_from_board = camera_looking_at({0.0, 0.0}, 900.0, 35.0, 20.0);
  picture.lens = Lens::from_params(1000, 750, LensModel::opencv,
                                   {2000.0, 2000.0, 500.0, 375.0, -0.1, 0.0, 0.0, 0.0});
  picture.noise_sd = 2.0;
  picture.background = 180.0;
  const auto inside = [](double x, double y) {
    return std::hypot((x - 500.0) / 230.0, (y - 330.0) / 190.0) < 1.0;
  };
  picture.hidden = inside;
  const auto corners = detect_board(photograph(picture, board), board);
  const Accuracy a = accuracy(corners, picture, board);
  int visible = 0;
  for (const auto& corner : true_corners(picture, board)) {
    const bool in_frame =
        corner.x() > 10 && corner.x() < 990 && corner.y() > 10 && corner.y() < 740;
    // Well clear of the specimen's outline.
    const bool clear = std::hypot((corner.x() - 500.0) / 250.0, (corner.y() - 330.0) / 210.0) > 1.0;
    visible += in_frame && clear ? 1 : 0;
  }
  EXPECT_GE(a.found, visible * 95 / 100);
  EXPECT_GT(visible, 60);
  EXPECT_LT(a.mean_px, 0.03);
  EXPECT_LT(a.max_px, 0.3);
  for (const BoardCorner& corner : corners) {
    EXPECT_FALSE(inside(corner.position_px.x(), corner.position_px.y())) << corner.id;
  }
}

TEST(DetectBoard, LightMayFallOffAndShadowsMayCrossTheBoard) {
  BoardPicture picture = typical_picture();
  picture.noise_sd = 2.0;
  picture.light = [](double x, double y) {
    const double falloff = 1.15 - 0.9 * x / 800.0;
    // A soft shadow, 20 px from light to dark.
    const double across = std::clamp(((0.8 * x + 0.6 * y) - 520.0) / 20.0, 0.0, 1.0);
    const double over = std::clamp((560.0 + 80.0 - (0.8 * x + 0.6 * y)) / 20.0, 0.0, 1.0);
    return falloff * (1.0 - 0.55 * across * over);
  };
  const Accuracy a = measure(picture, small_board());
  EXPECT_GE(a.found, 32);
  EXPECT_LT(a.mean_px, 0.06);
  EXPECT_LT(a.max_px, 0.4);
}

TEST(DetectBoard, OverexposedPaperAndToneCurveDoNotShiftCorners) {
  BoardPicture picture = typical_picture();
  picture.blur_px = 1.0;
  Image8 image = photograph(picture, small_board());
  for (auto& level : image.pixels) {
    const double toned = 300.0 * std::pow(level / 255.0, 0.45);
    level = static_cast<std::uint8_t>(std::lround(std::min(255.0, toned)));
  }
  const Accuracy a = accuracy(detect_board(image, small_board()), picture, small_board());
  EXPECT_EQ(a.found, 35);
  EXPECT_LT(a.mean_px, 0.03);
}

TEST(DetectBoard, HeavyNoiseAndLowContrastGiveNoWrongCorner) {
  BoardPicture picture = typical_picture();
  picture.black = 40.0;
  picture.white = 100.0;
  picture.noise_sd = 12.0;
  const Accuracy a = measure(picture, small_board());
  EXPECT_GE(a.found, 20);
  EXPECT_LT(a.max_px, 0.5);
}

TEST(DetectBoard, ColourImagesWork) {
  const BoardPicture picture = typical_picture();
  const Image8 grey = photograph(picture, small_board());
  Image8 colour(grey.width, grey.height, 3);
  for (std::size_t i = 0; i < colour.pixels.size(); ++i) colour.pixels[i] = grey.pixels[i / 3];
  const Accuracy a = accuracy(detect_board(colour, small_board()), picture, small_board());
  EXPECT_EQ(a.found, 35);
  EXPECT_LT(a.max_px, 0.03);
}

TEST(DetectBoard, SameImageSameBytes) {
  BoardPicture picture = typical_picture();
  picture.noise_sd = 5.0;
  const Image8 image = photograph(picture, small_board());
  const auto first = detect_board(image, small_board());
  for (int run = 0; run < 3; ++run) {
    const auto again = detect_board(image, small_board());
    ASSERT_EQ(again.size(), first.size());
    for (std::size_t i = 0; i < first.size(); ++i) {
      EXPECT_EQ(again[i].id, first[i].id);
      EXPECT_EQ(again[i].position_px, first[i].position_px);
    }
  }
}

TEST(DetectBoard, OtherDictionariesWork) {
  for (const char* dictionary : {"DICT_4X4_100", "DICT_6X6_250", "DICT_APRILTAG_36h11"}) {
    CharucoBoard board = small_board();
    board.dictionary = dictionary;
    const Accuracy a = measure(typical_picture(), board);
    EXPECT_EQ(a.found, 35) << dictionary;
    EXPECT_LT(a.max_px, 0.03) << dictionary;
  }
}

TEST(DetectBoard, NothingWhereThereIsNoBoard) {
  EXPECT_TRUE(detect_board(Image8(), small_board()).empty());
  EXPECT_TRUE(detect_board(Image8(3, 3, 1), small_board()).empty());
  EXPECT_TRUE(detect_board(Image8(640, 480, 1, 128), small_board()).empty());
  Image8 noise(640, 480, 1);
  Random random(3);
  for (auto& level : noise.pixels) level = static_cast<std::uint8_t>(random.below(256));
  EXPECT_TRUE(detect_board(noise, small_board()).empty());
  // A bare chessboard has corners, yet no markers to name them.
  Image8 chess(640, 480, 1);
  for (int y = 0; y < 480; ++y) {
    for (int x = 0; x < 640; ++x) chess.at(x, y) = (x / 40 + y / 40) % 2 == 0 ? 20 : 220;
  }
  EXPECT_TRUE(detect_board(chess, small_board()).empty());
}

TEST(DetectBoard, AnotherBoardIsNotTakenForOurs) {
  const BoardPicture picture = typical_picture();
  const Image8 image = photograph(picture, small_board());
  CharucoBoard other = small_board();
  other.dictionary = "DICT_6X6_250";
  EXPECT_TRUE(detect_board(image, other).empty());
  other = small_board();
  other.squares_x = 10;  // its rows hold other markers
  EXPECT_TRUE(detect_board(image, other).empty());
  other.squares_x = 3;
  other.squares_y = 3;
  EXPECT_TRUE(detect_board(image, other).empty());
}

TEST(DetectBoard, MirroredBoardIsNone) {
  const BoardPicture picture = typical_picture();
  Image8 image = photograph(picture, small_board());
  for (int y = 0; y < image.height; ++y) std::reverse(image.row(y), image.row(y) + image.width);
  EXPECT_TRUE(detect_board(image, small_board()).empty());
}

TEST(DetectBoard, PartOfTheBoardIsEnough) {
  BoardPicture picture = typical_picture();
  picture.camera_from_board = camera_looking_at({75.0, 45.0}, 300.0, 60.0, 20.0);
  const Accuracy a = measure(picture, small_board());
  EXPECT_GE(a.found, 10);
  EXPECT_LT(a.found, 35);
  EXPECT_LT(a.max_px, 0.05);
}

}  // namespace
}  // namespace skullstation
