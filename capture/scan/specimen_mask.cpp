#include "capture/scan/specimen_mask.h"

#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "core/session/board_homography.h"

namespace skullstation {

namespace {

/// Fewer don't fix a homography well enough to look up squares far from them.
constexpr std::size_t corners_for_print = 8;

cv::Mat view_of(const Image8& image) {
  // OpenCV has no header over const pixels; the result is only read.
  return {image.height, image.width, CV_8UC(image.channels),
          const_cast<std::uint8_t*>(image.pixels.data())};
}

Image8 copy_of(const cv::Mat& mat) {
  Image8 image(mat.cols, mat.rows, 1);
  for (int y = 0; y < mat.rows; ++y) std::copy_n(mat.ptr(y), mat.cols, image.row(y));
  return image;
}

/// px of the quarter image (OpenCV's convention) from mm on the board.
cv::Matx33d homography(const std::vector<BoardCorner>& corners, const CharucoBoard& board) {
  std::vector<cv::Point2d> board_mm;
  std::vector<cv::Point2d> image_px;
  for (const BoardCorner& corner : corners) {
    const Eigen::Vector3d mm = board.corner(corner.id);
    board_mm.emplace_back(mm.x(), mm.y());
    const Eigen::Vector2d px = corner.position_px / ViewRegions::scale;
    image_px.emplace_back(px.x() - 0.5, px.y() - 0.5);
  }
  const cv::Mat found = cv::findHomography(board_mm, image_px);
  return found.empty() ? cv::Matx33d::zeros() : cv::Matx33d(found);
}

/// px of the quarter image from mm on the board about a few corners: affine, since perspective
/// would fit their noise. Nothing for corners (nearly) on a line.
std::optional<cv::Matx33d> affine_about(const std::vector<BoardCorner>& corners,
                                        const CharucoBoard& board) {
  Correspondences points;
  for (const BoardCorner& corner : corners) {
    points.board_mm.emplace_back(board.corner(corner.id).head<2>());
    points.image_px.emplace_back(corner.position_px / ViewRegions::scale -
                                 Eigen::Vector2d::Constant(0.5));
  }
  const auto map = fit_homography(points);
  if (!map) return std::nullopt;
  const Eigen::Matrix2d turn = map->jacobian(map->origin_mm);
  const Eigen::Vector2d shift = (*map)(map->origin_mm) - turn * map->origin_mm;
  return cv::Matx33d(turn(0, 0), turn(0, 1), shift.x(), turn(1, 0), turn(1, 1), shift.y(), 0.0, 0.0,
                     1.0);
}

/// Fills the image of a convex outline given in mm on the board.
void fill_outline(cv::Mat& mask, const cv::Matx33d& px_from_mm,
                  const std::vector<cv::Point2d>& outline_mm) {
  constexpr int fraction_bits = 4;
  std::vector<cv::Point> outline;
  for (const cv::Point2d& mm : outline_mm) {
    const cv::Vec3d h = px_from_mm * cv::Vec3d(mm.x, mm.y, 1.0);
    // Behind the camera's horizon: nothing to be filled there.
    if (h[2] * px_from_mm(2, 2) <= 0.0) return;
    outline.emplace_back(cv::saturate_cast<int>(h[0] / h[2] * (1 << fraction_bits)),
                         cv::saturate_cast<int>(h[1] / h[2] * (1 << fraction_bits)));
  }
  cv::fillConvexPoly(mask, outline, 255, cv::LINE_8, fraction_bits);
}

std::vector<cv::Point2d> board_outline(const CharucoBoard& board) {
  const double x = board.width_mm() / 2.0;
  const double y = board.height_mm() / 2.0;
  return {{-x, -y}, {x, -y}, {x, y}, {-x, y}};
}

/// The table as far as it may show around the board, out to so many times its corners' distance.
std::vector<cv::Point2d> table_outline(const CharucoBoard& board, double reach) {
  const double radius_mm = reach * std::hypot(board.width_mm(), board.height_mm()) / 2.0;
  std::vector<cv::Point2d> circle;
  for (int i = 0; i < 72; ++i) {
    const double angle = i * CV_2PI / 72.0;
    circle.emplace_back(radius_mm * std::cos(angle), radius_mm * std::sin(angle));
  }
  return circle;
}

/// 255 well inside the print's black squares, as the image shows them.
cv::Mat black_squares(const CharucoBoard& board, const cv::Matx33d& px_from_mm, cv::Size size) {
  constexpr int px_per_square = 16;
  const Image8 print = draw_board(board, px_per_square);
  cv::Mat black = view_of(print) < 128;
  // The markers' cells are too small for this; a square loses a fifth on each side.
  constexpr int margin = px_per_square / 5;
  cv::erode(black, black, cv::Mat(), {-1, -1}, margin, cv::BORDER_CONSTANT, cv::Scalar(0));
  // print px (OpenCV's convention) -> mm: x to the right, y up, origin in the middle
  const double mm_per_px = board.square_mm / px_per_square;
  const cv::Matx33d mm_from_print(mm_per_px, 0.0, 0.5 * mm_per_px - board.width_mm() / 2.0,  //
                                  0.0, -mm_per_px, board.height_mm() / 2.0 - 0.5 * mm_per_px, 0.0,
                                  0.0, 1.0);
  cv::Mat warped;
  cv::warpPerspective(black, warped, px_from_mm * mm_from_print, size, cv::INTER_NEAREST);
  return warped;
}

double percentile(std::vector<std::uint8_t> values, double fraction) {
  const auto nth = values.begin() + static_cast<std::ptrdiff_t>(fraction * (values.size() - 1));
  std::ranges::nth_element(values, nth);
  return *nth;
}

std::vector<std::uint8_t> values_where(const cv::Mat& image, const cv::Mat& mask) {
  std::vector<std::uint8_t> values;
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      if (mask.at<std::uint8_t>(y, x) != 0) values.push_back(image.at<std::uint8_t>(y, x));
    }
  }
  return values;
}

/// The backdrop's grey level: what the frame's rim mostly shows beside the table. The lower
/// quartile, since a specimen that is cut off shows there too.
double backdrop_level(const cv::Mat& grey, const cv::Mat& table) {
  cv::Mat rim(grey.size(), CV_8UC1, cv::Scalar(255));
  constexpr int width = 3;
  if (grey.cols > 2 * width && grey.rows > 2 * width) {
    rim(cv::Rect(width, width, grey.cols - 2 * width, grey.rows - 2 * width)) = 0;
  }
  rim.setTo(0, table);
  const std::vector<std::uint8_t> levels = values_where(grey, rim);
  // A camera that looks down sees the table only: the darkest there is black print.
  if (levels.size() < 50)
    return percentile(values_where(grey, cv::Mat(grey.size(), CV_8UC1, 255)), 0.05);
  return percentile(levels, 0.25);
}

/// Pixels above `high`, with all that is above `low` and connected to them.
cv::Mat hysteresis(const cv::Mat& grey, const cv::Mat& where, double low, double high) {
  cv::Mat candidates = grey > low;
  candidates &= where;
  cv::Mat labels;
  const int count = cv::connectedComponents(candidates, labels, 8, CV_32S);
  std::vector<bool> bright(static_cast<std::size_t>(count), false);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      if (grey.at<std::uint8_t>(y, x) > high) {
        bright[static_cast<std::size_t>(labels.at<int>(y, x))] = true;
      }
    }
  }
  bright[0] = false;
  cv::Mat kept(grey.size(), CV_8UC1);
  for (int y = 0; y < grey.rows; ++y) {
    for (int x = 0; x < grey.cols; ++x) {
      kept.at<std::uint8_t>(y, x) =
          bright[static_cast<std::size_t>(labels.at<int>(y, x))] ? 255 : 0;
    }
  }
  return kept;
}

/// Where the board's black squares are covered by something brighter, squares in between filled.
cv::Mat covered_board(const cv::Mat& grey, const CharucoBoard& board, const cv::Matx33d& px_from_mm,
                      const cv::Mat& board_region) {
  const cv::Mat black = black_squares(board, px_from_mm, grey.size());
  const std::vector<std::uint8_t> levels = values_where(grey, black);
  if (levels.size() < 50) return cv::Mat::zeros(grey.size(), CV_8UC1);
  const std::vector<std::uint8_t> all = values_where(grey, board_region);
  const double ink = percentile(levels, 0.2);
  const double paper = percentile(all, 0.9);
  cv::Mat covered = grey > ink + 0.45 * (paper - ink);
  covered &= black;
  cv::medianBlur(covered, covered, 3);  // single pixels at the squares' edges
  const double side_px = std::sqrt(cv::countNonZero(board_region) /
                                   static_cast<double>(board.squares_x * board.squares_y));
  const int reach = std::max(1, static_cast<int>(std::lround(0.8 * side_px)));
  const cv::Mat disc = cv::getStructuringElement(cv::MORPH_ELLIPSE, {2 * reach + 1, 2 * reach + 1});
  cv::morphologyEx(covered, covered, cv::MORPH_CLOSE, disc);
  covered &= board_region;
  return covered;
}

/// The largest connected part and those that are not much smaller: a mandible lies by itself.
cv::Mat large_parts(const cv::Mat& mask) {
  constexpr double smallest_share = 0.05;
  cv::Mat labels;
  cv::Mat stats;
  cv::Mat centroids;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centroids, 8, CV_32S);
  int largest = 0;
  for (int i = 1; i < count; ++i) largest = std::max(largest, stats.at<int>(i, cv::CC_STAT_AREA));
  cv::Mat kept(mask.size(), CV_8UC1);
  for (int y = 0; y < mask.rows; ++y) {
    for (int x = 0; x < mask.cols; ++x) {
      const int label = labels.at<int>(y, x);
      const bool keep =
          label > 0 && stats.at<int>(label, cv::CC_STAT_AREA) >= smallest_share * largest;
      kept.at<std::uint8_t>(y, x) = keep ? 255 : 0;
    }
  }
  return kept;
}

}  // namespace

ViewRegions find_specimen(const Image8& grey, const std::vector<BoardCorner>& corners,
                          const std::optional<CharucoBoard>& board) {
  const cv::Size size((grey.width + ViewRegions::scale - 1) / ViewRegions::scale,
                      (grey.height + ViewRegions::scale - 1) / ViewRegions::scale);
  cv::Mat small;
  cv::resize(view_of(grey), small, size, 0.0, 0.0, cv::INTER_AREA);

  cv::Mat board_region = cv::Mat::zeros(size, CV_8UC1);
  cv::Mat table = cv::Mat::zeros(size, CV_8UC1);
  cv::Mat specimen = cv::Mat::zeros(size, CV_8UC1);
  if (board && corners.size() >= corners_for_print) {
    const cv::Matx33d px_from_mm = homography(corners, *board);
    fill_outline(board_region, px_from_mm, board_outline(*board));
    fill_outline(table, px_from_mm, table_outline(*board, 1.1));
    table |= board_region;
    specimen = covered_board(small, *board, px_from_mm, board_region);
  } else if (board && !corners.empty()) {
    // Somewhere there are white squares: where is known roughly, or not at all.
    if (const auto px_from_mm = affine_about(corners, *board)) {
      fill_outline(board_region, *px_from_mm, board_outline(*board));
      fill_outline(table, *px_from_mm, table_outline(*board, 1.6));
    } else {
      table = 255;
    }
  }
  // Steps above the backdrop, in grey levels: bone lit by the station's lamps is at 100 or more.
  constexpr double low_step = 20.0;
  constexpr double high_step = 45.0;
  const double backdrop = backdrop_level(small, table);
  cv::Mat off_table;
  cv::bitwise_not(table, off_table);
  specimen |= hysteresis(small, off_table, backdrop + low_step, backdrop + high_step);
  return {copy_of(large_parts(specimen)), copy_of(board_region)};
}

}  // namespace skullstation
