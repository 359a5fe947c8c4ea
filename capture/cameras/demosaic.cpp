#include "capture/cameras/demosaic.h"

#include <algorithm>
#include <vector>

namespace skullstation {
namespace {

constexpr int kBorder = 2;

/// Mirrors an index about the first and the last pixel: -1 -> 1, count -> count - 2.
int mirrored(int index, int count) {
  while (index < 0 || index >= count) {
    index = index < 0 ? -index : 2 * (count - 1) - index;
  }
  return index;
}

Image16 with_mirrored_border(const Image16& mosaic) {
  Image16 padded(mosaic.width + 2 * kBorder, mosaic.height + 2 * kBorder, 1);
  for (int y = 0; y < padded.height; ++y) {
    const std::uint16_t* from = mosaic.row(mirrored(y - kBorder, mosaic.height));
    std::uint16_t* to = padded.row(y);
    std::copy_n(from, mosaic.width, to + kBorder);
    for (int x = 0; x < kBorder; ++x) {
      to[x] = from[mirrored(x - kBorder, mosaic.width)];
      to[kBorder + mosaic.width + x] = from[mirrored(mosaic.width + x, mosaic.width)];
    }
  }
  return padded;
}

/// The filters of Malvar, He & Cutler 2004, figure 2, with their weights (in eighths there)
/// doubled so that all are whole. `p` is the pixel, `row` the distance to the pixel below.
class Neighbourhood {
 public:
  Neighbourhood(const std::uint16_t* p, std::ptrdiff_t row) : p_(p), row_(row) {}

  int green_at_red_or_blue() const { return 8 * at(0, 0) + 4 * cross() - 2 * far_cross(); }
  /// The colour that lies left and right of this green pixel.
  int beside_green() const {
    return 10 * at(0, 0) + 8 * (at(-1, 0) + at(1, 0)) - 2 * diagonals() -
           2 * (at(-2, 0) + at(2, 0)) + (at(0, -2) + at(0, 2));
  }
  /// The colour that lies above and below this green pixel.
  int above_green() const {
    return 10 * at(0, 0) + 8 * (at(0, -1) + at(0, 1)) - 2 * diagonals() -
           2 * (at(0, -2) + at(0, 2)) + (at(-2, 0) + at(2, 0));
  }
  int blue_at_red_or_red_at_blue() const {
    return 12 * at(0, 0) + 4 * diagonals() - 3 * far_cross();
  }

 private:
  int at(int dx, int dy) const { return p_[dy * row_ + dx]; }
  int cross() const { return at(-1, 0) + at(1, 0) + at(0, -1) + at(0, 1); }
  int far_cross() const { return at(-2, 0) + at(2, 0) + at(0, -2) + at(0, 2); }
  int diagonals() const { return at(-1, -1) + at(1, -1) + at(-1, 1) + at(1, 1); }

  const std::uint16_t* p_;
  std::ptrdiff_t row_;
};

}  // namespace

Image16 demosaic(const Image16& mosaic, BayerOrder order, int maximum) {
  const Image16 padded = with_mirrored_border(mosaic);
  Image16 colour(mosaic.width, mosaic.height, 3);
  // Parity of the red pixels' column and row; blue lies on the other diagonal corner.
  const int red_x = order == BayerOrder::grbg || order == BayerOrder::bggr ? 1 : 0;
  const int red_y = order == BayerOrder::gbrg || order == BayerOrder::bggr ? 1 : 0;
  const auto level = [maximum](int sixteenths) {
    return static_cast<std::uint16_t>(std::clamp((sixteenths + 8) >> 4, 0, maximum));
  };
  for (int y = 0; y < mosaic.height; ++y) {
    const std::uint16_t* from = padded.row(y + kBorder) + kBorder;
    std::uint16_t* to = colour.row(y);
    const bool red_row = (y & 1) == red_y;
    for (int x = 0; x < mosaic.width; ++x, to += 3) {
      const Neighbourhood near(from + x, padded.width);
      const bool red_column = (x & 1) == red_x;
      if (red_row == red_column) {  // a red or a blue pixel
        to[red_row ? 0 : 2] = from[x];
        to[1] = level(near.green_at_red_or_blue());
        to[red_row ? 2 : 0] = level(near.blue_at_red_or_red_at_blue());
      } else {
        to[red_row ? 0 : 2] = level(near.beside_green());
        to[1] = from[x];
        to[red_row ? 2 : 0] = level(near.above_green());
      }
    }
  }
  return colour;
}

}  // namespace skullstation
