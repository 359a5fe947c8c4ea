#include "capture/scan/image_quality.h"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "capture/scan/specimen_mask.h"

namespace skullstation {

namespace {

cv::Mat view_of(const Image8& image) {
  // OpenCV has no header over const pixels; the result is only read.
  return {image.height, image.width, CV_8UC(image.channels),
          const_cast<std::uint8_t*>(image.pixels.data())};
}

Image8 grey_of(const Image8& image) {
  if (image.channels == 1) return image;
  Image8 grey(image.width, image.height, 1);
  cv::Mat target = view_of(grey);
  cv::cvtColor(view_of(image), target, cv::COLOR_RGB2GRAY);
  return grey;
}

cv::Mat reduced(const cv::Mat& image, int factor) {
  cv::Mat smaller;
  // Whole blocks only, so that every level covers the same pixels.
  const cv::Rect whole(0, 0, image.cols / factor * factor, image.rows / factor * factor);
  cv::resize(image(whole), smaller, {}, 1.0 / factor, 1.0 / factor, cv::INTER_AREA);
  return smaller;
}

// ---- board ----

/// Half the resolution shows all but the smallest markers in a fraction of the time; where it does
/// not, the whole is looked at.
std::vector<BoardCorner> board_corners(const Image8& grey, const CharucoBoard& board) {
  constexpr int large_px = 1000;
  constexpr int enough_share = 4;  // a quarter of all corners
  if (std::max(grey.width, grey.height) >= large_px) {
    Image8 half(grey.width / 2, grey.height / 2, 1);
    reduced(view_of(grey), 2).copyTo(view_of(half));
    std::vector<BoardCorner> corners = detect_board(half, board);
    if (static_cast<int>(corners.size()) * enough_share >= board.corner_count()) {
      for (BoardCorner& corner : corners) corner.position_px *= 2.0;
      return corners;
    }
  }
  return detect_board(grey, board);
}

// ---- levels and the frame's border ----

void measure_levels(const Image8& image, const Image8& grey, const Image8& specimen,
                    ViewQuality& quality) {
  constexpr int dark_level = 8;
  std::int64_t pixels = 0;
  std::int64_t clipped = 0;
  std::int64_t dark = 0;
  std::int64_t sum = 0;
  for (int y = 0; y < image.height; ++y) {
    const std::uint8_t* mask = specimen.row(y / ViewRegions::scale);
    const std::uint8_t* colors = image.row(y);
    const std::uint8_t* levels = grey.row(y);
    for (int x = 0; x < image.width; ++x) {
      if (mask[x / ViewRegions::scale] == 0) continue;
      ++pixels;
      sum += levels[x];
      if (levels[x] < dark_level) ++dark;
      const std::uint8_t* color = colors + static_cast<std::ptrdiff_t>(x) * image.channels;
      if (std::find(color, color + image.channels, 255) != color + image.channels) ++clipped;
    }
  }
  const double all = static_cast<double>(image.width) * image.height;
  quality.specimen_percent = 100.0 * static_cast<double>(pixels) / all;
  if (pixels == 0) return;
  quality.clipped_percent = 100.0 * static_cast<double>(clipped) / static_cast<double>(pixels);
  quality.dark_percent = 100.0 * static_cast<double>(dark) / static_cast<double>(pixels);
  quality.mean_level = static_cast<double>(sum) / static_cast<double>(pixels);
}

double border_percent(const Image8& specimen) {
  int border = 0;
  int touched = 0;
  for (int y = 0; y < specimen.height; ++y) {
    for (int x = 0; x < specimen.width; ++x) {
      if (x != 0 && y != 0 && x != specimen.width - 1 && y != specimen.height - 1) continue;
      ++border;
      if (specimen.at(x, y) != 0) ++touched;
    }
  }
  return border == 0 ? 0.0 : 100.0 * touched / border;
}

// ---- sharpness ----

/// Four-neighbour Laplacian of the pixel at `p`.
int laplacian(const std::uint8_t* p, std::ptrdiff_t stride) {
  return p[-1] + p[1] + p[-stride] + p[stride] - 4 * p[0];
}

/// Mean product of the two frames' Laplacians over the mask: their energy, without the noise,
/// which is independent between frames.
double detail_energy(const cv::Mat& image, const cv::Mat& earlier, const cv::Mat& mask) {
  const int mask_scale =
      std::max(1, static_cast<int>(std::lround(static_cast<double>(image.cols) / mask.cols)));
  const auto stride = static_cast<std::ptrdiff_t>(image.step);
  const auto earlier_stride = static_cast<std::ptrdiff_t>(earlier.step);
  std::int64_t product = 0;
  std::int64_t pixels = 0;
  for (int y = 1; y + 1 < image.rows; ++y) {
    const std::uint8_t* mask_row = mask.ptr(std::min(y / mask_scale, mask.rows - 1));
    const std::uint8_t* row = image.ptr(y);
    const std::uint8_t* earlier_row = earlier.ptr(y);
    for (int x = 1; x + 1 < image.cols; ++x) {
      if (mask_row[std::min(x / mask_scale, mask.cols - 1)] == 0) continue;
      product += static_cast<std::int64_t>(laplacian(row + x, stride)) *
                 laplacian(earlier_row + x, earlier_stride);
      ++pixels;
    }
  }
  if (pixels == 0) return 0.0;
  return std::max(0.0, static_cast<double>(product) / static_cast<double>(pixels));
}

double sharpness(const cv::Mat& grey, const cv::Mat& earlier, const cv::Mat& specimen) {
  cv::Mat inside;  // silhouettes are strong edges in any view
  cv::erode(specimen, inside, cv::Mat(), {-1, -1}, 3, cv::BORDER_CONSTANT, cv::Scalar(0));
  const double fine = detail_energy(grey, earlier, inside);
  const double coarse = detail_energy(reduced(grey, 4), reduced(earlier, 4), inside);
  return coarse > 0.0 ? fine / coarse : 0.0;
}

// ---- motion ----

/// Shift [px] of a block between two frames, by least squares on brightness constancy (Lucas &
/// Kanade 1981) with a change of gain and offset, so that flicker is no motion. Nothing for a
/// block without enough texture: one where noise of `noise_sd` grey levels could shift the result
/// by more than `certain_px`.
std::optional<double> block_shift(const cv::Mat& before, const cv::Mat& after, cv::Rect block,
                                  double noise_sd, double certain_px) {
  Eigen::Matrix4d normal = Eigen::Matrix4d::Zero();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (int y = std::max(1, block.y); y < std::min(before.rows - 1, block.y + block.height); ++y) {
    for (int x = std::max(1, block.x); x < std::min(before.cols - 1, block.x + block.width); ++x) {
      // Gradients of the mean of both frames: half the noise, and symmetric in time.
      const auto sum = [&](int at_y, int at_x) {
        return before.at<std::uint8_t>(at_y, at_x) + after.at<std::uint8_t>(at_y, at_x);
      };
      const double gx = (sum(y, x + 1) - sum(y, x - 1)) / 4.0;
      const double gy = (sum(y + 1, x) - sum(y - 1, x)) / 4.0;
      const double change = after.at<std::uint8_t>(y, x) - before.at<std::uint8_t>(y, x);
      const Eigen::Vector4d row(-gx, -gy, sum(y, x) / 512.0, 1.0);
      normal += row * row.transpose();
      right += row * change;
    }
  }
  const Eigen::LDLT<Eigen::Matrix4d> solver(normal + 1e-6 * Eigen::Matrix4d::Identity());
  const Eigen::Matrix4d inverse = solver.solve(Eigen::Matrix4d::Identity());
  if (noise_sd * std::sqrt(inverse.topLeftCorner<2, 2>().trace()) > certain_px) return std::nullopt;
  return solver.solve(right).head<2>().norm();
}

/// Upper quartile of the blocks' shifts, in pixels of the full image; 0 if no block has texture.
double upper_quartile_shift(const cv::Mat& before, const cv::Mat& after, const cv::Mat& turning,
                            int scale, int block_side) {
  constexpr double certain_px = 0.15;  // of the full image
  // Of the difference of two frames after reduction and smoothing, on the safe side.
  constexpr double noise_sd = 2.0;
  std::vector<double> shifts;
  for (int y = 0; y + block_side <= before.rows; y += block_side) {
    for (int x = 0; x + block_side <= before.cols; x += block_side) {
      const int mask_x = (x + block_side / 2) * scale / ViewRegions::scale;
      const int mask_y = (y + block_side / 2) * scale / ViewRegions::scale;
      if (mask_x >= turning.cols || mask_y >= turning.rows ||
          turning.at<std::uint8_t>(mask_y, mask_x) == 0) {
        continue;
      }
      const auto shift =
          block_shift(before, after, {x, y, block_side, block_side}, noise_sd, certain_px / scale);
      if (shift) shifts.push_back(*shift * scale);
    }
  }
  if (shifts.empty()) return 0.0;
  const auto quartile = shifts.begin() + static_cast<std::ptrdiff_t>(shifts.size() * 3 / 4);
  std::ranges::nth_element(shifts, quartile);
  return *quartile;
}

double motion_px(const cv::Mat& before, const cv::Mat& after, const cv::Mat& turning) {
  // Finite differences take the slope of a hard edge too low, and so its shift too high.
  const auto smooth = [](const cv::Mat& image, int scale) {
    cv::Mat smoothed;
    cv::GaussianBlur(reduced(image, scale), smoothed, {5, 5}, 1.0);
    return smoothed;
  };
  // The fine level measures what the gate decides on; the coarse one notices shifts that are too
  // large for the fine one's linearisation, of which it can't tell the size.
  double motion = 0.0;
  for (const auto& [scale, block_side] : {std::pair{2, 32}, std::pair{8, 16}}) {
    motion = std::max(motion, upper_quartile_shift(smooth(before, scale), smooth(after, scale),
                                                   turning, scale, block_side));
  }
  return motion;
}

}  // namespace

ViewQuality measure_view(const Image8& image, const Image8* earlier,
                         const std::optional<CharucoBoard>& board) {
  ViewQuality quality;
  constexpr int smallest_px = 16;  // nothing can be told about less
  if (std::min(image.width, image.height) < smallest_px) return quality;
  const Image8 grey = grey_of(image);
  std::vector<BoardCorner> corners;
  if (board) corners = board_corners(grey, *board);
  quality.board_corners = static_cast<int>(corners.size());

  const ViewRegions regions = find_specimen(grey, corners, board);
  measure_levels(image, grey, regions.specimen, quality);
  quality.border_percent = border_percent(regions.specimen);

  const Image8 earlier_grey = earlier != nullptr ? grey_of(*earlier) : grey;
  const cv::Mat before = view_of(earlier_grey);
  const cv::Mat after = view_of(grey);
  const cv::Mat specimen = view_of(regions.specimen);
  quality.sharpness = sharpness(after, before, specimen);
  if (earlier != nullptr) {
    quality.motion_px = motion_px(before, after, specimen | view_of(regions.board));
  }
  return quality;
}

}  // namespace skullstation
