#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <vector>

#include "core/session/aruco.h"
#include "core/session/board_homography.h"
#include "core/session/board_pattern.h"
#include "core/session/charuco_board.h"
#include "core/session/corner_fit.h"

// The way of detect_board(): decoded markers that agree with their neighbours seed the corners
// beside them; each is fitted in the image; from fitted corners the positions of those around them
// follow, marker or not, and are fitted too. All predictions are local, so that lens distortion
// does not matter, and a wrongly decoded marker is alone in its opinion.

namespace skullstation {

namespace {

struct SeenMarker {
  BoardMarker marker;
  Eigen::Matrix<double, 4, 2> board_mm;
  Eigen::Matrix<double, 4, 2> image_px;
};

std::vector<SeenMarker> find_markers(const Image8& grey, const CharucoBoard& board) {
  const cv::Mat image(grey.height, grey.width, CV_8UC1,
                      const_cast<std::uint8_t*>(grey.pixels.data()));  // only read
  const std::vector<BoardMarker> markers = board_markers(board);
  std::vector<SeenMarker> seen;
  for (const ArucoDetection& detection :
       detect_aruco(image, aruco_markers(board.dictionary), static_cast<int>(markers.size()))) {
    SeenMarker marker;
    marker.marker = markers.at(detection.id);
    marker.board_mm = marker_corners(board, marker.marker);
    for (int i = 0; i < 4; ++i) {
      // OpenCV counts from the centre of the top-left pixel.
      marker.image_px.row(i) << detection.corners_cv[i].x + 0.5, detection.corners_cv[i].y + 0.5;
    }
    seen.push_back(marker);
  }
  // OpenCV's order depends on its threads.
  std::sort(seen.begin(), seen.end(), [](const SeenMarker& a, const SeenMarker& b) {
    if (a.marker.id != b.marker.id) return a.marker.id < b.marker.id;
    return std::lexicographical_compare(a.image_px.data(), a.image_px.data() + 8, b.image_px.data(),
                                        b.image_px.data() + 8);
  });
  return seen;
}

/// Does `map` put the marker's corners where they are seen, to half the marker's size?
bool agrees(const Homography& map, const SeenMarker& marker) {
  double perimeter = 0.0;
  double worst = 0.0;
  for (int i = 0; i < 4; ++i) {
    perimeter += (marker.image_px.row(i) - marker.image_px.row((i + 1) % 4)).norm();
    const Eigen::Vector2d predicted = map(marker.board_mm.row(i).transpose());
    worst = std::max(worst, (predicted - marker.image_px.row(i).transpose()).norm());
  }
  return worst < 0.5 * perimeter / 4.0;
}

/// The markers that agree with each other about where the board is: the largest group linked by
/// neighbours that predict each other, and what a homography through that group predicts too.
std::vector<SeenMarker> consistent_markers(const std::vector<SeenMarker>& seen) {
  constexpr int neighbourhood = 3;  // squares
  const int count = static_cast<int>(seen.size());
  std::vector<std::optional<Homography>> maps;
  maps.reserve(count);
  for (const SeenMarker& marker : seen) {
    Correspondences corners;
    corners.add(marker.board_mm, marker.image_px);
    maps.push_back(fit_homography(corners));
  }
  std::vector<int> group(count);
  std::iota(group.begin(), group.end(), 0);
  const auto root = [&](int i) {
    while (group[i] != i) i = group[i];
    return i;
  };
  for (int i = 0; i < count; ++i) {
    for (int j = i + 1; j < count; ++j) {
      const BoardMarker& a = seen[i].marker;
      const BoardMarker& b = seen[j].marker;
      if (a.id == b.id || std::abs(a.column - b.column) > neighbourhood ||
          std::abs(a.row - b.row) > neighbourhood || !maps[i] || !maps[j]) {
        continue;
      }
      if (agrees(*maps[i], seen[j]) && agrees(*maps[j], seen[i])) group[root(j)] = root(i);
    }
  }
  std::map<int, int> sizes;
  for (int i = 0; i < count; ++i) ++sizes[root(i)];
  int largest = -1;
  for (const auto& [candidate, size] : sizes) {
    if (largest < 0 || size > sizes[largest]) largest = candidate;
  }
  // One marker alone may be any texture's accident.
  if (largest < 0 || sizes[largest] < 2) return {};

  Correspondences of_group;
  for (int i = 0; i < count; ++i) {
    if (root(i) == largest) of_group.add(seen[i].board_mm, seen[i].image_px);
  }
  const auto map = fit_homography(of_group);
  std::vector<SeenMarker> kept;
  for (int i = 0; i < count; ++i) {
    if (root(i) == largest || (sizes[largest] >= 4 && map && agrees(*map, seen[i]))) {
      kept.push_back(seen[i]);
    }
  }
  return kept;
}

/// Inner corners by column and row (0-based), as far as they are known.
class CornerGrid {
 public:
  explicit CornerGrid(const CharucoBoard& board)
      : board_(board), corners_(static_cast<std::size_t>(board.corner_count())) {}

  int columns() const { return board_.squares_x - 1; }
  int rows() const { return board_.squares_y - 1; }
  bool inside(int column, int row) const {
    return column >= 0 && row >= 0 && column < columns() && row < rows();
  }
  std::optional<FittedCorner>& at(int column, int row) {
    return corners_[static_cast<std::size_t>(row * columns() + column)];
  }
  Eigen::Vector2d board_mm(int column, int row) const {
    return board_.corner(row * columns() + column).head<2>();
  }

  /// Known corners around a place within `radius`, itself left out.
  Correspondences around(int column, int row, int radius) {
    Correspondences known;
    for (int y = row - radius; y <= row + radius; ++y) {
      for (int x = column - radius; x <= column + radius; ++x) {
        if (!inside(x, y) || (x == column && y == row) || !at(x, y)) continue;
        known.board_mm.push_back(board_mm(x, y));
        known.image_px.push_back(at(x, y)->position_px);
      }
    }
    return known;
  }

 private:
  const CharucoBoard& board_;
  std::vector<std::optional<FittedCorner>> corners_;
};

/// What every corner's fit needs to know.
struct Search {
  const Image8& grey;
  const CharucoBoard& board;
  double ring_mm = 0.0;  ///< the black ring around each marker's bits
};

std::optional<FittedCorner> fit_at(const Search& search, int column, int row,
                                   const Eigen::Vector2d& mm, const Homography& map) {
  const CharucoBoard& board = search.board;
  const Image8& grey = search.grey;
  ExpectedCorner expected;
  expected.position_px = map(mm);
  expected.px_from_mm = map.jacobian(mm);
  // The square to the upper right of the corner is (column + 1, row) from the page's top left.
  expected.first_quadrant_white = (column + row) % 2 == 0;
  expected.free_mm = 0.5 * (board.square_mm - board.marker_mm);
  expected.ring_mm = search.ring_mm;
  expected.square_mm = board.square_mm;
  const double area = std::abs(expected.px_from_mm.determinant());
  const double narrow =
      area / std::max(expected.px_from_mm.col(0).norm(), expected.px_from_mm.col(1).norm());
  expected.max_shift_px = std::max(1.0, 0.25 * board.square_mm * narrow);
  if (!(area > 0.0) || !expected.position_px.allFinite()) return std::nullopt;
  // At the very rim half of the corner's picture is missing.
  constexpr double rim_px = 3.0;
  const Eigen::Vector2d far_rim(grey.width - rim_px, grey.height - rim_px);
  if ((expected.position_px.array() < rim_px).any() ||
      (expected.position_px.array() > far_rim.array()).any()) {
    return std::nullopt;
  }
  return fit_corner(grey, expected);
}

void seed_from_markers(const Search& search, const std::vector<SeenMarker>& markers,
                       CornerGrid& grid) {
  std::vector<Correspondences> touching(static_cast<std::size_t>(search.board.corner_count()));
  for (const SeenMarker& seen : markers) {
    for (int dy = -1; dy <= 0; ++dy) {
      for (int dx = -1; dx <= 0; ++dx) {
        const int column = seen.marker.column + dx;
        const int row = seen.marker.row + dy;
        if (!grid.inside(column, row)) continue;
        touching[static_cast<std::size_t>(row * grid.columns() + column)].add(seen.board_mm,
                                                                              seen.image_px);
      }
    }
  }
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const auto map =
          fit_homography(touching[static_cast<std::size_t>(row * grid.columns() + column)]);
      if (!map) continue;
      grid.at(column, row) = fit_at(search, column, row, grid.board_mm(column, row), *map);
    }
  }
}

/// Corners whose neighbours are known, again and again until none is added.
void grow(const Search& search, CornerGrid& grid) {
  std::vector<std::size_t> tried(static_cast<std::size_t>(search.board.corner_count()));
  for (bool added = true; added;) {
    added = false;
    for (int row = 0; row < grid.rows(); ++row) {
      for (int column = 0; column < grid.columns(); ++column) {
        if (grid.at(column, row)) continue;
        const Correspondences known = grid.around(column, row, 2);
        // Tried again only when more is known around it.
        std::size_t& tried_with = tried[static_cast<std::size_t>(row * grid.columns() + column)];
        if (known.board_mm.size() < 4 || known.board_mm.size() <= tried_with) {
          continue;
        }
        tried_with = known.board_mm.size();
        const auto map = fit_homography(known);
        if (!map) continue;
        auto fitted = fit_at(search, column, row, grid.board_mm(column, row), *map);
        if (!fitted) continue;
        grid.at(column, row) = fitted;
        added = true;
      }
    }
  }
}

/// Removes corners whose picture is much less like a corner's than that of most others: partly
/// hidden ones, whose position suffers from it.
void drop_unlike_others(CornerGrid& grid) {
  constexpr double always_good = 0.02;  // of the variance; leaves every position right
  constexpr double times_typical = 3.0;
  std::vector<double> unexplained;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      if (const auto& corner = grid.at(column, row)) unexplained.push_back(corner->unexplained);
    }
  }
  if (unexplained.empty()) return;
  const auto middle = unexplained.begin() + static_cast<std::ptrdiff_t>(unexplained.size() / 2);
  std::nth_element(unexplained.begin(), middle, unexplained.end());
  const double limit = std::max(always_good, times_typical * *middle);
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      auto& corner = grid.at(column, row);
      if (corner && corner->unexplained > limit) corner.reset();
    }
  }
}

/// A corner's distance from where its neighbours say it is.
struct Departure {
  std::optional<FittedCorner>* corner = nullptr;
  double px = 0.0;
  double allowed_px = 0.0;
};

/// Departures of all corners; those that no neighbours confirm are removed.
std::vector<Departure> departures(const CharucoBoard& board, CornerGrid& grid) {
  // A lens bends the grid by far less than this between neighbours.
  constexpr double allowed_squares = 0.04;
  constexpr double allowed_px = 0.4;
  std::vector<Departure> result;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      auto& corner = grid.at(column, row);
      if (!corner) continue;
      const Correspondences known = grid.around(column, row, 2);
      const auto map = known.board_mm.size() < 4 ? std::nullopt : fit_homography(known);
      if (!map) {
        corner.reset();
        continue;
      }
      const Eigen::Vector2d mm = grid.board_mm(column, row);
      const double square_px =
          board.square_mm * std::sqrt(std::abs(map->jacobian(mm).determinant()));
      result.push_back({&corner, ((*map)(mm)-corner->position_px).norm(),
                        allowed_px + allowed_squares * square_px});
    }
  }
  return result;
}

/// Removes corners that don't lie where their neighbours say, the worst first: fitted to something
/// else, or half hidden.
void drop_inconsistent(const CharucoBoard& board, CornerGrid& grid) {
  constexpr double always_good_px = 0.3;
  constexpr double times_typical = 6.0;
  while (true) {
    const std::vector<Departure> all = departures(board, grid);
    if (all.empty()) return;
    std::vector<double> sizes;
    sizes.reserve(all.size());
    for (const Departure& departure : all) sizes.push_back(departure.px);
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    const double usual_px = std::max(always_good_px, times_typical * *middle);
    double worst = 1.0;
    std::optional<FittedCorner>* worst_corner = nullptr;
    for (const Departure& departure : all) {
      const double excess = departure.px / std::min(usual_px, departure.allowed_px);
      if (!(excess <= worst)) {
        worst = excess;
        worst_corner = departure.corner;
      }
    }
    if (worst_corner == nullptr) return;
    worst_corner->reset();
  }
}

Image8 grey_of(const Image8& image) {
  if (image.channels == 1) return image;
  Image8 grey(image.width, image.height, 1);
  for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
    // Luma weights of BT.601, in 1/256.
    const std::uint8_t* rgb = &image.pixels[3 * i];
    grey.pixels[i] =
        static_cast<std::uint8_t>((77 * rgb[0] + 150 * rgb[1] + 29 * rgb[2] + 128) >> 8);
  }
  return grey;
}

}  // namespace

std::vector<BoardCorner> detect_board(const Image8& image, const CharucoBoard& board) {
  // The smallest threshold window of the marker detection.
  if (image.width < 16 || image.height < 16 || !board.validate()) return {};
  const Image8 grey = grey_of(image);
  const std::vector<SeenMarker> seen = find_markers(grey, board);
  const std::vector<SeenMarker> markers = consistent_markers(seen);
  // Where most markers contradict the group, it is another board, of whose rows one may fit.
  if (markers.empty() || 2 * markers.size() <= seen.size()) return {};
  const int marker_bits_across = marker_dictionary(board.dictionary)->bits + 2;
  const Search search{grey, board, board.marker_mm / marker_bits_across};
  CornerGrid grid(board);
  seed_from_markers(search, markers, grid);
  grow(search, grid);
  drop_unlike_others(grid);
  drop_inconsistent(board, grid);
  std::vector<BoardCorner> corners;
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      if (const auto& corner = grid.at(column, row)) {
        corners.push_back({row * grid.columns() + column, corner->position_px});
      }
    }
  }
  return corners;
}

}  // namespace skullstation
