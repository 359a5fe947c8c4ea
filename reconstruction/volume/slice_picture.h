#pragma once

#include <Eigen/Core>
#include <span>

#include "core/image.h"
#include "core/triangle_mesh.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// A slice of a volume that is oriented to the patient's axes.
struct SlicePlane {
  int axis = 2;  ///< 0 sagittal, 1 coronal, 2 axial
  int index = 0;
};

/// A surface whose section is drawn over a slice.
struct SliceOutline {
  const TriangleMesh* mesh = nullptr;    ///< patient coordinates, mm
  Eigen::Vector3d color{1.0, 0.5, 0.0};  ///< sRGB in [0, 1]
};

struct SlicePictureOptions {
  double pixel_mm = 0.5;
  int black_hu = -600;
  int white_hu = 1800;
};

/// The slice in grey, values interpolated, with the surfaces' sections over it, as radiologists
/// look at it: axial from the feet, coronal from the front (the patient's left is on the right),
/// sagittal from the left.
/// \pre the volume comes from oriented_to_patient_axes; 0 <= index < size along the axis
Image8 slice_picture(const Volume& volume, const SlicePlane& plane,
                     std::span<const SliceOutline> outlines,
                     const SlicePictureOptions& options = {});

}  // namespace skullstation
