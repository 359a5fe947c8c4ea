#pragma once

#include <span>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/session/charuco_board.h"
#include "reconstruction/photogrammetry/masks_evidence.h"

namespace skullstation {

struct MaskOptions {
  /// A view whose own picture of the specimen and that of all others differ by more than both of
  /// these shows something else, or a specimen that was moved: this share of it ...
  double always_good_mismatch = 0.05;
  /// ... and so many times the median of all views.
  double times_median = 3.0;
  int threads = 0;
};

struct ViewMask {
  Image8 mask;            ///< 255 specimen, 0 background, soft at the edge; the photograph's size
  double mismatch = 0.0;  ///< share of the specimen's picture that the other views contradict
  std::string odd;        ///< what is wrong with the view; empty if nothing
};

/// Masks of the specimen in all views of one pass, without any hand at work: what single pixels
/// say (find_mask_evidence()) is put to a vote of all views about the space they look at, and each
/// mask is the picture of that hull, its outline drawn by the view's own pixels. Inside, only what
/// surely shows the board or lies outside the hull is background: shadows in hollows are not.
/// Errors: `bad_input` for fewer than 3 views, those of the vote, `cancelled`.
Result<std::vector<ViewMask>> find_masks(std::span<const MaskView> views, const CharucoBoard* board,
                                         const MaskOptions& options = {},
                                         const Progress& progress = {});

/// Intersection over union of two masks of one size, pixels above 127 counting.
double mask_overlap(const Image8& a, const Image8& b);

}  // namespace skullstation
