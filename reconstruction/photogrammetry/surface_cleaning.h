#pragma once

#include <vector>

#include "core/result.h"
#include "reconstruction/photogrammetry/surface_extraction.h"

namespace skullstation {

struct CleaningOptions {
  /// Connected pieces smaller than this share of the largest one's area are dropped.
  double least_piece_share = 0.004;

  Result<void> validate() const;
};

/// The surface without its small pieces.
FusedSurface without_small_pieces(const FusedSurface& surface, const CleaningOptions& options);

/// Those triangles that `kept` flags, and the vertices that they need, in the same order.
FusedSurface selected_triangles(const FusedSurface& surface, const std::vector<bool>& kept);

}  // namespace skullstation
