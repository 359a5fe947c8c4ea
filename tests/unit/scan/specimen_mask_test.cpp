#include "capture/scan/specimen_mask.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/units.h"

namespace skullstation {
namespace {

constexpr int width = 480;
constexpr int height = 360;

/// A pinhole camera that looks at the table's middle from `elevation_deg` above its horizon.
struct TableView {
  double elevation_deg = 30.0;
  std::optional<CharucoBoard> board;
  double specimen_radius_px = 0.0;  ///< of a disc of bone before the table's middle; 0: none
  double specimen_y_px = 150.0;

  /// The point on the table seen in a pixel [mm]; nothing above the horizon.
  std::optional<Eigen::Vector2d> on_table(double x_px, double y_px) const {
    const double focal_px = 500.0;
    const double distance_mm = 650.0;
    const double c = std::cos(radians(elevation_deg));
    const double s = std::sin(radians(elevation_deg));
    // Camera axes in the table's frame: x right, y down the picture, z forward.
    const Eigen::Vector3d forward(0.0, c, -s);
    const Eigen::Vector3d down(0.0, -s, -c);
    const Eigen::Vector3d ray = forward * focal_px +
                                Eigen::Vector3d::UnitX() * (x_px - width / 2.0) +
                                down * (y_px - 1.2 * height / 2.0);
    if (ray.z() >= 0.0) return std::nullopt;
    const Eigen::Vector3d eye = -distance_mm * forward;
    return (eye - ray * (eye.z() / ray.z())).head<2>();
  }

  bool shows_specimen(double x_px, double y_px) const {
    return std::hypot(x_px - width / 2.0, y_px - specimen_y_px) < specimen_radius_px;
  }

  Image8 render() const {
    constexpr int px_per_square = 40;
    const Image8 print = board ? draw_board(*board, px_per_square) : Image8();
    const auto level = [&](double x, double y) {
      if (shows_specimen(x, y)) return 150.0;
      const auto mm = on_table(x, y);
      if (!mm || mm->norm() > 265.0) return 18.0;
      if (!board) return 30.0;
      const double scale = px_per_square / board->square_mm;
      const int u = static_cast<int>(std::floor((mm->x() + board->width_mm() / 2.0) * scale));
      const int v = static_cast<int>(std::floor((board->height_mm() / 2.0 - mm->y()) * scale));
      if (u < 0 || v < 0 || u >= print.width || v >= print.height) return 30.0;
      return print.at(u, v) > 127 ? 190.0 : 22.0;
    };
    Image8 image(width, height, 1);
    Random noise(5);
    for (int y = 0; y < height; ++y) {
      for (int x = 0; x < width; ++x) {
        double sum = 0.0;
        constexpr int samples = 4;
        for (int i = 0; i < samples * samples; ++i) {
          sum += level(x + (i % samples + 0.5) / samples, y + (i / samples + 0.5) / samples);
        }
        image.at(x, y) = static_cast<std::uint8_t>(
            std::clamp(std::lround(sum / (samples * samples) + noise.normal(0.0, 2.0)), 0L, 255L));
      }
    }
    return image;
  }

  ViewRegions regions() const {
    const Image8 image = render();
    std::vector<BoardCorner> corners;
    if (board) {
      corners = detect_board(image, *board);
      EXPECT_GE(corners.size(), 8U);
    }
    return find_specimen(image, corners, board);
  }
};

/// Squares large enough to be read in a small picture.
const CharucoBoard coarse_board{"DICT_5X5_1000", 7, 7, 50.0, 38.0};

struct Agreement {
  double right = 0.0;     // part of what was found that is the specimen
  double complete = 0.0;  // part of the specimen that was found
  double found = 0.0;     // part of the frame
};

Agreement compare(const TableView& view, const ViewRegions& regions) {
  double found = 0.0;
  double truth = 0.0;
  double both = 0.0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const bool is_found =
          regions.specimen.at(x / ViewRegions::scale, y / ViewRegions::scale) != 0;
      const bool is_specimen = view.shows_specimen(x + 0.5, y + 0.5);
      found += is_found;
      truth += is_specimen;
      both += is_found && is_specimen;
    }
  }
  return {found > 0.0 ? both / found : 1.0, truth > 0.0 ? both / truth : 1.0,
          found / (width * height)};
}

Agreement agreement(const TableView& view) { return compare(view, view.regions()); }

TEST(FindSpecimen, OnABoardItIsRightAboutNearlyAllItFinds) {
  for (const double elevation_deg : {20.0, 30.0, 50.0}) {
    TableView view{elevation_deg, coarse_board, 75.0};
    const Agreement found = agreement(view);
    EXPECT_GT(found.right, 0.95) << elevation_deg;
    EXPECT_GT(found.complete, 0.4) << elevation_deg;
  }
}

TEST(FindSpecimen, InFrontOfTheBoardAloneItIsFoundByTheSquaresItHides) {
  TableView view{60.0, CharucoBoard{"DICT_5X5_1000", 10, 10, 35.0, 28.0}, 60.0, 216.0};
  const Agreement found = agreement(view);
  EXPECT_GT(found.right, 0.9);
  EXPECT_GT(found.complete, 0.5);
}

TEST(FindSpecimen, WithFewCornersInSightNoSquareOfTheBoardPassesForBone) {
  // A large specimen in front of the board leaves a few markers along its rim.
  const TableView view{60.0, coarse_board, 60.0, 216.0};
  const Image8 image = view.render();
  std::vector<BoardCorner> corners = detect_board(image, coarse_board);
  ASSERT_GE(corners.size(), 1U);
  for (std::size_t count = std::min<std::size_t>(corners.size(), 5); count >= 1; --count) {
    corners.resize(count);
    EXPECT_GT(compare(view, find_specimen(image, corners, coarse_board)).right, 0.95) << count;
  }
}

TEST(FindSpecimen, WhatStandsAboveARoughlyKnownBoardIsFoundThere) {
  const TableView view{20.0, coarse_board, 75.0, 60.0};
  const Image8 image = view.render();
  std::vector<BoardCorner> corners = detect_board(image, coarse_board);
  ASSERT_GE(corners.size(), 8U);
  // Four of them, around one square.
  const auto of_square = [&](const BoardCorner& corner) {
    const int first = 3 * 6 + 2;
    return corner.id == first || corner.id == first + 1 || corner.id == first + 6 ||
           corner.id == first + 7;
  };
  std::erase_if(corners, [&](const BoardCorner& corner) { return !of_square(corner); });
  ASSERT_EQ(corners.size(), 4U);
  const Agreement found = compare(view, find_specimen(image, corners, coarse_board));
  EXPECT_GT(found.right, 0.95);
  EXPECT_GT(found.complete, 0.4);
}

TEST(FindSpecimen, WithoutABoardItIsWhatIsBrighterThanBackdropAndTable) {
  const Agreement found = agreement({30.0, std::nullopt, 75.0});
  EXPECT_GT(found.right, 0.95);
  EXPECT_GT(found.complete, 0.95);
}

TEST(FindSpecimen, AnEmptyTableHasNone) {
  EXPECT_LT(agreement({30.0, coarse_board}).found, 0.003);
  EXPECT_EQ(agreement({30.0, std::nullopt}).found, 0.0);
}

TEST(FindSpecimen, TellsWhereTheBoardIs) {
  const TableView view{30.0, coarse_board, 75.0};
  const ViewRegions regions = view.regions();
  int wrong = 0;
  int truth = 0;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const auto mm = view.on_table(x + 0.5, y + 0.5);
      const bool is_board = mm && std::abs(mm->x()) < 175.0 && std::abs(mm->y()) < 175.0;
      truth += is_board;
      wrong += is_board != (regions.board.at(x / ViewRegions::scale, y / ViewRegions::scale) != 0);
    }
  }
  EXPECT_LT(wrong, 0.05 * truth);  // the outline, at a quarter of the resolution
}

}  // namespace
}  // namespace skullstation
