#pragma once

#include <Eigen/Core>
#include <string>

#include "core/image.h"
#include "core/result.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// A camera without distortion: x_px = fx x/z + cx. Pixel (0.5, 0.5) is the centre of the top-left
/// pixel.
struct Pinhole {
  int width = 0;
  int height = 0;
  double fx = 0.0, fy = 0.0, cx = 0.0, cy = 0.0;

  Eigen::Vector2d project(const Eigen::Vector3d& x_camera) const {
    return {fx * x_camera.x() / x_camera.z() + cx, fy * x_camera.y() / x_camera.z() + cy};
  }
  /// (x, y, 1) of the ray through an image point.
  Eigen::Vector3d ray(double x_px, double y_px) const {
    return {(x_px - cx) / fx, (y_px - cy) / fy, 1.0};
  }
  /// The camera of an image reduced to 1/2^level of its size (rounded down).
  Pinhole reduced(int level) const;
};

/// One photograph made ready for stereo: distortion undone, cut to the specimen.
struct StereoView {
  std::string name;           ///< for messages: the image's path
  int pass = 0;               ///< views of different passes show different placements
  Pinhole camera;             ///< of the cut image
  Rigid3 camera_from_table;   ///< x_camera = R x_table + t, mm
  Image8 color;               ///< 1 or 3 channels, undistorted
  Image8 mask;                ///< 0 background .. 255 specimen, soft at the edge
  bool cut_by_frame = false;  ///< the specimen goes on beyond the photograph's border

  Eigen::Vector3d centre_mm() const { return camera_from_table.inverse().translation; }
};

/// Undoes the lens's distortion by bicubic interpolation (Keys 1981) and cuts the image to the
/// mask's bounding box plus `margin_px`. An empty mask image means that all of it is specimen.
/// Fails with `bad_input` (naming the view) where sizes disagree, the mask is black or the lens is
/// folded inside the image.
Result<StereoView> make_stereo_view(const std::string& name, const Image8& photograph,
                                    const Image8& mask, const Lens& lens,
                                    const Rigid3& camera_from_table, int pass, int margin_px = 24);

/// 1-channel image of half the size (rounded down), each pixel the mean of four.
Image8 halved(const Image8& image);

/// The specimen's fine texture around a mid grey, twice as strong: the image less its own blur
/// (Gaussian, `blur_sd_px`, over pixels inside the mask only). What is left out is the shading: the
/// lamps stand still while the specimen turns, so that their light slides over its surface and
/// looks, on a convex one, as if it lay behind it.
Image8 without_shading(const Image8& grey, const Image8& mask, double blur_sd_px);

/// Luma of an RGB image (Rec. 601), or the image itself.
Image8 grey_of(const Image8& image);

}  // namespace skullstation
