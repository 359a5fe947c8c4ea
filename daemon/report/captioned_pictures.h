#pragma once

#include <Eigen/Core>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "daemon/report/report.h"
#include "reconstruction/rendering/mesh_picture.h"

namespace skullstation {

struct ReportPictureOptions {
  int width_px = 420;  ///< and height
  int samples = 16;    ///< rays a pixel
  int threads = 0;     ///< 0: all
};

/// Adds a picture of the meshes together from each of the sides (names of head_sides()). The
/// caption is followed by the side's name; without one the side's name stands alone.
Result<void> add_sides(CaptionedPictures& pictures, std::span<const PicturedMesh> meshes,
                       std::initializer_list<std::string_view> sides, const std::string& caption,
                       const ReportPictureOptions& options);

/// A colour for each vertex: from dark blue (`low`) over green to yellow (`high`); grey where the
/// value is not a number. After viridis (Smith & van der Walt 2015), which reads the same in grey
/// and for the colour-blind.
Colors scalar_colors(const Eigen::VectorXd& values, double low, double high);

}  // namespace skullstation
