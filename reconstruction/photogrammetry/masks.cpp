#include "reconstruction/photogrammetry/masks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "reconstruction/photogrammetry/masks_votes.h"

namespace skullstation {

namespace {

/// Pixels within `reach` (a square) of a pixel that is set.
Image8 grown(const Image8& mask, int reach) {
  Image8 across(mask.width, mask.height, 1);
  Image8 result(mask.width, mask.height, 1);
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) == 0) continue;
      for (int i = std::max(0, x - reach); i <= std::min(mask.width - 1, x + reach); ++i) {
        across.at(i, y) = 255;
      }
    }
  }
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (across.at(x, y) == 0) continue;
      for (int i = std::max(0, y - reach); i <= std::min(mask.height - 1, y + reach); ++i) {
        result.at(x, i) = 255;
      }
    }
  }
  return result;
}

Image8 inverted(Image8 mask) {
  for (std::uint8_t& value : mask.pixels) value = value == 0 ? 255 : 0;
  return mask;
}

/// Only what is set in a 3 x 3 neighbourhood's majority: single noisy pixels go.
Image8 without_specks(const Image8& mask) {
  Image8 result = mask;
  for (int y = 1; y + 1 < mask.height; ++y) {
    for (int x = 1; x + 1 < mask.width; ++x) {
      int set = 0;
      for (int dy = -1; dy <= 1; ++dy) {
        for (int dx = -1; dx <= 1; ++dx) set += mask.at(x + dx, y + dy) != 0 ? 1 : 0;
      }
      result.at(x, y) = set >= 5 ? 255 : 0;
    }
  }
  return result;
}

/// The largest connected part and those that are not much smaller: a mandible may lie by itself.
Image8 large_parts(const Image8& mask) {
  constexpr double least_share = 0.02;
  std::vector<int> part(mask.pixels.size(), -1);
  std::vector<int> sizes;
  std::vector<int> open;
  for (std::size_t start = 0; start < part.size(); ++start) {
    if (mask.pixels[start] == 0 || part[start] >= 0) continue;
    const int label = static_cast<int>(sizes.size());
    sizes.push_back(0);
    part[start] = label;
    open.push_back(static_cast<int>(start));
    while (!open.empty()) {
      const int at = open.back();
      open.pop_back();
      ++sizes.back();
      const int x = at % mask.width;
      const auto visit = [&](bool exists, int next) {
        const auto i = static_cast<std::size_t>(next);
        if (!exists || mask.pixels[i] == 0 || part[i] >= 0) return;
        part[i] = label;
        open.push_back(next);
      };
      visit(x > 0, at - 1);
      visit(x + 1 < mask.width, at + 1);
      visit(at >= mask.width, at - mask.width);
      visit(at + mask.width < static_cast<int>(part.size()), at + mask.width);
    }
  }
  Image8 kept(mask.width, mask.height, 1);
  if (sizes.empty()) return kept;
  const double least = least_share * *std::ranges::max_element(sizes);
  for (std::size_t i = 0; i < part.size(); ++i) {
    if (part[i] >= 0 && sizes[static_cast<std::size_t>(part[i])] >= least) kept.pixels[i] = 255;
  }
  return kept;
}

/// The hull's picture with its outline drawn anew: within `band` pixels of it each pixel's own
/// evidence decides, deeper inside only a whole patch of background makes a hole.
Image8 drawn_mask(const Image8& silhouette, const Image<MaskEvidence>& evidence) {
  constexpr int band = 2;
  const Image8 reach = grown(silhouette, 1);
  const Image8 core = inverted(grown(inverted(silhouette), band));
  Image8 sure(evidence.width, evidence.height, 1);
  for (std::size_t i = 0; i < sure.pixels.size(); ++i) {
    sure.pixels[i] = evidence.pixels[i] == MaskEvidence::background ? 255 : 0;
  }
  Image8 mask(evidence.width, evidence.height, 1);
  for (std::size_t i = 0; i < mask.pixels.size(); ++i) {
    const bool inside = core.pixels[i] != 0 || (silhouette.pixels[i] != 0 && sure.pixels[i] == 0) ||
                        (reach.pixels[i] != 0 && evidence.pixels[i] == MaskEvidence::specimen);
    mask.pixels[i] = inside ? 255 : 0;
  }
  return large_parts(without_specks(mask));
}

/// Share of the specimen that this view shows and the others' hull does not, or the other way.
double mismatch_of(const Image8& silhouette, const Image<MaskEvidence>& evidence) {
  constexpr int tolerance = 2;
  const Image8 reach = grown(silhouette, tolerance);
  const Image8 core = inverted(grown(inverted(silhouette), tolerance));
  double area = 0.0;
  double contradicted = 0.0;
  for (std::size_t i = 0; i < core.pixels.size(); ++i) {
    area += silhouette.pixels[i] != 0 ? 1.0 : 0.0;
    const bool missing = core.pixels[i] != 0 && evidence.pixels[i] == MaskEvidence::background;
    const bool beyond = reach.pixels[i] == 0 && evidence.pixels[i] == MaskEvidence::specimen;
    contradicted += missing || beyond ? 1.0 : 0.0;
  }
  return area > 0.0 ? contradicted / area : 1.0;
}

/// Bilinear, soft at the edge over the reduced pixel that holds it.
Image8 enlarged(const Image8& mask, int width, int height) {
  Image8 result(width, height, 1);
  for (int y = 0; y < height; ++y) {
    const double fy = std::clamp((y + 0.5) / kMaskScale - 0.5, 0.0, mask.height - 1.0);
    const int y0 = std::min(static_cast<int>(fy), mask.height - 2);
    for (int x = 0; x < width; ++x) {
      const double fx = std::clamp((x + 0.5) / kMaskScale - 0.5, 0.0, mask.width - 1.0);
      const int x0 = std::min(static_cast<int>(fx), mask.width - 2);
      const double u = fx - x0;
      const double v = fy - y0;
      const double value = (1.0 - v) * ((1.0 - u) * mask.at(x0, y0) + u * mask.at(x0 + 1, y0)) +
                           v * ((1.0 - u) * mask.at(x0, y0 + 1) + u * mask.at(x0 + 1, y0 + 1));
      result.at(x, y) = static_cast<std::uint8_t>(std::lround(value));
    }
  }
  return result;
}

void name_odd_views(std::vector<ViewMask>& masks, const MaskOptions& options) {
  std::vector<double> sorted;
  for (const ViewMask& mask : masks) sorted.push_back(mask.mismatch);
  std::sort(sorted.begin(), sorted.end());
  const double typical = sorted[sorted.size() / 2];
  const double limit = std::max(options.always_good_mismatch, options.times_median * typical);
  for (ViewMask& mask : masks) {
    if (mask.mismatch <= limit) continue;
    mask.odd = fmt::format(
        "the other views contradict {:.0f} % of what it shows of the specimen (in most views it is "
        "{:.0f} %): the specimen was moved, or it is another one",
        100.0 * mask.mismatch, 100.0 * typical);
  }
}

}  // namespace

Result<std::vector<ViewMask>> find_masks(std::span<const MaskView> views, const CharucoBoard* board,
                                         const MaskOptions& options, const Progress& progress) {
  if (views.size() < 3) {
    return fail(ErrorKind::bad_input, "masks", "need 3 views of a pass or more");
  }
  constexpr int px_per_square = 40;
  const Image8 print = board != nullptr ? draw_board(*board, px_per_square) : Image8{};
  std::vector<Image<MaskEvidence>> evidence(views.size());
  progress.report(0.0, "telling the specimen from board and backdrop");
  parallel_for(static_cast<int>(views.size()), options.threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    if (progress.stop.stop_requested()) return;
    evidence[at] = find_mask_evidence(views[at], board, print, px_per_square);
  });
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "masks", "stopped");
  progress.report(0.5, "telling the specimen from board and backdrop");
  VoteOptions vote;
  vote.threads = options.threads;
  // The board's own thickness and the print's glare: below it nothing is told apart.
  constexpr double above_board_mm = 1.0;
  if (board != nullptr) vote.floor_mm = above_board_mm;
  const auto hull = vote_hull(views, evidence, vote);
  if (!hull) return forward(hull);
  std::vector<ViewMask> masks(views.size());
  parallel_for(static_cast<int>(views.size()), options.threads, [&](int i) {
    const auto at = static_cast<std::size_t>(i);
    const Image8 silhouette = hull_silhouette(*hull, views[at]);
    masks[at].mismatch = mismatch_of(silhouette, evidence[at]);
    masks[at].mask = enlarged(drawn_mask(silhouette, evidence[at]), views[at].photograph->width,
                              views[at].photograph->height);
  });
  name_odd_views(masks, options);
  progress.report(1.0, "telling the specimen from board and backdrop");
  return masks;
}

double mask_overlap(const Image8& a, const Image8& b) {
  std::size_t both = 0;
  std::size_t either = 0;
  for (std::size_t i = 0; i < a.pixels.size() && i < b.pixels.size(); ++i) {
    const bool in_a = a.pixels[i] > 127;
    const bool in_b = b.pixels[i] > 127;
    both += in_a && in_b ? 1U : 0U;
    either += in_a || in_b ? 1U : 0U;
  }
  return either == 0 ? 1.0 : static_cast<double>(both) / static_cast<double>(either);
}

}  // namespace skullstation
