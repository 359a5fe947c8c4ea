#pragma once

#include <optional>

#include "core/image.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// A view, and how its camera stands to the board (if there is one in the picture).
struct MaskView {
  const Image8* photograph = nullptr;
  Lens lens;
  Rigid3 camera_from_table;
  std::optional<Rigid3> camera_from_board;
};

/// What single pixels say of the specimen.
enum class MaskEvidence : std::uint8_t {
  background,  ///< looks just like the backdrop or the board's print there
  unclear,     ///< could be either
  specimen     ///< too bright, or of another colour than what lies behind
};

/// The evidence of a view's pixels at a quarter of its resolution (mean of 4 x 4 pixels; sizes
/// rounded down). Off the board the backdrop's brightness is looked up along the image's rim; on
/// the board the print is predicted from the pose, its ink and paper are measured, and white
/// squares, as bright as bone, are told from it by their colour where the specimen has another.
/// `print` is draw_board() of the board. Shadows count as background.
Image<MaskEvidence> find_mask_evidence(const MaskView& view, const CharucoBoard* board,
                                       const Image8& print, int print_px_per_square);

inline constexpr int kMaskScale = 4;

}  // namespace skullstation
