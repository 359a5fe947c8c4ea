#include "reconstruction/photogrammetry/masks_evidence.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

namespace skullstation {

namespace {

/// Grey level and colour of a reduced pixel.
struct Tone {
  float level = 0.0F;
  float warmth = 0.0F;  ///< (R - B) / (R + G + B)
};

Image<Tone> reduced_tones(const Image8& photograph) {
  Image<Tone> tones(photograph.width / kMaskScale, photograph.height / kMaskScale, 1);
  const int channels = photograph.channels;
  constexpr float pixels = kMaskScale * kMaskScale;
  for (int y = 0; y < tones.height; ++y) {
    for (int x = 0; x < tones.width; ++x) {
      std::array<float, 3> sum{};
      for (int dy = 0; dy < kMaskScale; ++dy) {
        const std::uint8_t* row = photograph.row(y * kMaskScale + dy) + x * kMaskScale * channels;
        for (int i = 0; i < kMaskScale * channels; ++i) {
          sum[static_cast<std::size_t>(i % channels)] += row[i];
        }
      }
      if (channels == 1) sum = {sum[0], sum[0], sum[0]};
      const float total = sum[0] + sum[1] + sum[2];
      tones.at(x, y) = {(0.299F * sum[0] + 0.587F * sum[1] + 0.114F * sum[2]) / pixels,
                        (sum[0] - sum[2]) / std::max(total, 1.0F)};
    }
  }
  return tones;
}

float quantile(std::vector<float> values, double fraction) {
  const auto nth = values.begin() +
                   static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), nth, values.end());
  return *nth;
}

/// Where the corners of the reduced pixels see the board's plane [mm]; NaN where they don't.
std::vector<Eigen::Vector2f> plane_points(const MaskView& view, int width, int height) {
  const Rigid3 board_from_camera = view.camera_from_board->inverse();
  const Eigen::Vector2f nowhere = Eigen::Vector2f::Constant(std::nanf(""));
  std::vector<Eigen::Vector2f> points;
  points.reserve(static_cast<std::size_t>(width + 1) * (height + 1));
  for (int y = 0; y <= height; ++y) {
    for (int x = 0; x <= width; ++x) {
      points.push_back(nowhere);
      const auto ray = view.lens.ray({1.0 * kMaskScale * x, 1.0 * kMaskScale * y});
      if (!ray) continue;
      const Eigen::Vector3d direction = board_from_camera.rotation * *ray;
      const double reach = -board_from_camera.translation.z() / direction.z();
      if (!(reach > 0.0)) continue;
      points.back() = (board_from_camera.translation + reach * direction).head<2>().cast<float>();
    }
  }
  return points;
}

/// Share of white that the board's print has at each reduced pixel; -1 off the board.
ImageF predicted_print(const MaskView& view, const CharucoBoard& board, const Image8& print,
                       int px_per_square, int width, int height) {
  ImageF share(width, height, 1, -1.0F);
  const std::vector<Eigen::Vector2f> points = plane_points(view, width, height);
  const auto px_per_mm = static_cast<float>(px_per_square / board.square_mm);
  const Eigen::Vector2f half_board(static_cast<float>(0.5 * board.width_mm()),
                                   static_cast<float>(0.5 * board.height_mm()));
  constexpr int samples = 4;  // along a reduced pixel's side
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Eigen::Vector2f* upper = &points[static_cast<std::size_t>(y) * (width + 1) + x];
      const Eigen::Vector2f* lower = upper + width + 1;
      float sum = 0.0F;
      bool inside = true;
      for (int s = 0; s < samples * samples && inside; ++s) {
        const float u = (static_cast<float>(s % samples) + 0.5F) / samples;
        const float v = (static_cast<float>(s / samples) + 0.5F) / samples;
        const Eigen::Vector2f at = (1.0F - v) * ((1.0F - u) * upper[0] + u * upper[1]) +
                                   v * ((1.0F - u) * lower[0] + u * lower[1]);
        const float column = std::floor((at.x() + half_board.x()) * px_per_mm);
        const float row = std::floor((half_board.y() - at.y()) * px_per_mm);
        // False for NaN as well.
        inside = column >= 0.0F && row >= 0.0F && column < static_cast<float>(print.width) &&
                 row < static_cast<float>(print.height);
        if (inside) {
          sum += static_cast<float>(print.at(static_cast<int>(column), static_cast<int>(row))) /
                 255.0F;
        }
      }
      if (inside) share.at(x, y) = sum / (samples * samples);
    }
  }
  return share;
}

/// The backdrop's brightness: along the rim, where no print is predicted. The lower quartile, since
/// a specimen or a board's margin may reach the rim.
float backdrop_level(const Image<Tone>& tones, const ImageF& print) {
  constexpr int rim = 4;
  std::vector<float> levels;
  for (int y = 0; y < tones.height; ++y) {
    for (int x = 0; x < tones.width; ++x) {
      const bool at_rim = x < rim || y < rim || x >= tones.width - rim || y >= tones.height - rim;
      if (at_rim && (print.empty() || print.at(x, y) < 0.0F)) {
        levels.push_back(tones.at(x, y).level);
      }
    }
  }
  if (levels.size() >= 50) return quantile(std::move(levels), 0.25);
  // The camera sees nothing but the board: black print is the darkest there is.
  levels.clear();
  for (const Tone& tone : tones.pixels) levels.push_back(tone.level);
  return quantile(std::move(levels), 0.05);
}

/// Ink and paper as this view shows them.
struct Print {
  float ink = 0.0F;
  float paper = 255.0F;
  bool color_known = false;
  float warmth = 0.0F;  ///< of the paper
  float warmth_sd = 0.01F;
};

/// Nothing if too little of the print can be seen.
std::optional<Print> measured_print(const Image<Tone>& tones, const ImageF& share) {
  std::vector<float> dark;
  for (std::size_t i = 0; i < share.pixels.size(); ++i) {
    if (share.pixels[i] >= 0.0F && share.pixels[i] < 0.02F) dark.push_back(tones.pixels[i].level);
  }
  if (dark.size() < 50) return std::nullopt;
  Print print;
  print.ink = quantile(std::move(dark), 0.2);
  // Thin white lines fill no whole pixel: what a pixel's white share would be by itself.
  std::vector<float> bright;
  for (std::size_t i = 0; i < share.pixels.size(); ++i) {
    if (share.pixels[i] < 0.4F) continue;
    bright.push_back(print.ink + (tones.pixels[i].level - print.ink) / share.pixels[i]);
  }
  if (bright.size() < 50) return std::nullopt;
  // A specimen hides a part of the paper, the lamps light it unevenly.
  print.paper = std::max(quantile(std::move(bright), 0.6), print.ink + 20.0F);
  // Partly white cells near black squares that show their ink are the board for certain.
  std::vector<float> warmths;
  constexpr int farthest = 8;
  for (int y = farthest; y + farthest < tones.height; ++y) {
    for (int x = farthest; x + farthest < tones.width; ++x) {
      if (!(share.at(x, y) > 0.4F) || tones.at(x, y).level < 50.0F) continue;
      int beside_ink = 0;
      int beside_other = 0;
      for (const auto& [dx, dy] :
           {std::pair(1, 0), std::pair(-1, 0), std::pair(0, 1), std::pair(0, -1)}) {
        int step = 1;
        while (step <= farthest && share.at(x + step * dx, y + step * dy) > 0.02F) ++step;
        if (step > farthest || share.at(x + step * dx, y + step * dy) < 0.0F) continue;
        const bool shows_ink = tones.at(x + step * dx, y + step * dy).level <
                               print.ink + 0.25F * (print.paper - print.ink);
        ++(shows_ink ? beside_ink : beside_other);
      }
      if (beside_ink > 0 && beside_other == 0) warmths.push_back(tones.at(x, y).warmth);
    }
  }
  if (warmths.size() < 50) return print;
  print.color_known = true;
  print.warmth = quantile(warmths, 0.5);
  print.warmth_sd = std::max(0.006F, 0.74F * (quantile(warmths, 0.75) - quantile(warmths, 0.25)));
  return print;
}

}  // namespace

Image<MaskEvidence> find_mask_evidence(const MaskView& view, const CharucoBoard* board,
                                       const Image8& print, int print_px_per_square) {
  const Image<Tone> tones = reduced_tones(*view.photograph);
  Image<MaskEvidence> evidence(tones.width, tones.height, 1, MaskEvidence::unclear);
  ImageF share;
  std::optional<Print> seen;
  if (board != nullptr && view.camera_from_board) {
    share = predicted_print(view, *board, print, print_px_per_square, tones.width, tones.height);
    seen = measured_print(tones, share);
  }
  // Steps above what lies behind, in grey levels: lit bone is at 100 or more.
  constexpr float surely_behind = 14.0F;
  constexpr float surely_before = 28.0F;
  const float backdrop = backdrop_level(tones, share);

  // The specimen's colour, from where it covers what ought to be dark.
  std::vector<float> warmths;
  for (std::size_t i = 0; i < tones.pixels.size(); ++i) {
    const bool on_print = !share.empty() && share.pixels[i] >= 0.0F;
    if (on_print && seen && share.pixels[i] < 0.02F &&
        tones.pixels[i].level > seen->ink + 0.4F * (seen->paper - seen->ink)) {
      warmths.push_back(tones.pixels[i].warmth);
    }
  }
  const bool color_known = seen && seen->color_known && warmths.size() >= 30;
  const float specimen_warmth = color_known ? quantile(std::move(warmths), 0.5) : 0.0F;
  const bool color_tells =
      color_known && std::abs(specimen_warmth - seen->warmth) > 4.0F * seen->warmth_sd;

  for (std::size_t i = 0; i < tones.pixels.size(); ++i) {
    const Tone& tone = tones.pixels[i];
    MaskEvidence& said = evidence.pixels[i];
    const bool on_print = !share.empty() && share.pixels[i] >= 0.0F;
    const float behind =
        on_print && seen ? seen->ink + share.pixels[i] * (seen->paper - seen->ink) : backdrop;
    if (on_print && !seen && share.pixels[i] >= 0.02F) {
      said = MaskEvidence::unclear;  // white for all that is known
    } else if (tone.level > 1.3F * behind + surely_before) {
      said = MaskEvidence::specimen;
    } else if (tone.level < behind + surely_behind && (!on_print || share.pixels[i] < 0.02F)) {
      said = MaskEvidence::background;
    } else if (on_print && color_tells && tone.level > 40.0F) {
      // How far the colour has gone from the paper's to the specimen's.
      const float way = (tone.warmth - seen->warmth) / (specimen_warmth - seen->warmth);
      said = way > 0.65F   ? MaskEvidence::specimen
             : way < 0.35F ? MaskEvidence::background
                           : MaskEvidence::unclear;
    } else if (on_print && share.pixels[i] >= 0.02F && tone.level < 0.6F * behind) {
      said = MaskEvidence::background;  // paper in the specimen's shadow
    }
  }
  return evidence;
}

}  // namespace skullstation
