#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "capture/simulation/scene.h"
#include "core/image.h"
#include "core/result.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// A camera's optics and where it stands.
struct CameraOptics {
  Lens lens;
  Rigid3 camera_from_station;
  double aperture_mm = 1.2;          ///< diameter of the entrance pupil (f/8 at 9.6 mm); 0: pinhole
  double focus_distance_mm = 650.0;  ///< from the pupil to the plane in focus, along z
  double vignetting = 1.0;           ///< exponent on the natural cos^4 fall-off; 0: none

  Result<void> validate() const;
};

/// Optics with the distortion undone beforehand for the corners of all pixels.
class PreparedOptics {
 public:
  /// Fails (bad_input) for optics that make no sense and for a lens whose distortion folds inside
  /// the image.
  static Result<PreparedOptics> prepare(const CameraOptics& optics, int threads);

  const CameraOptics& optics() const { return optics_; }
  void set_focus_distance_mm(double distance_mm) { optics_.focus_distance_mm = distance_mm; }

  /// (x, y) of the ray (x, y, 1) through the image point. Bilinear between the corners of a pixel:
  /// within 1e-3 px of Lens::ray for lenses of practical use.
  Eigen::Vector2d ray(double x_px, double y_px) const;

  /// How (x, y) of the ray changes over the width and over the height of a pixel.
  std::pair<Eigen::Vector2d, Eigen::Vector2d> pixel_size(int x, int y) const;

 private:
  CameraOptics optics_;
  std::vector<Eigen::Vector2d> corner_rays_;  // (width + 1) x (height + 1), row-major
};

struct RenderOptions {
  int samples = 4;  ///< per pixel, everywhere: a power of two; textures are filtered to match
  int samples_at_outlines = 16;  ///< per pixel at and beside the outline of an object
  /// Per pixel at and beside the edges of shadows and sharp turns of the surface.
  int samples_where_uneven = 8;
  /// What counts as a sharp turn: (max - min) / (max + min) of the light on the surface.
  double uneven_light = 0.2;
  std::uint64_t seed = 1;  ///< of the sampling pattern; change it for every view
  int threads = 0;

  Result<void> validate() const;
};

/// Light on the sensor, 3 channels, linear: 1 is the radiance of a white diffuser at full scale,
/// vignetting included. `table_angles_deg` are the table's true angles at evenly spaced moments
/// from the beginning to the end of the exposure, at least one; more than one different angle
/// gives motion blur. Each pixel is the mean over its square, the pupil and the exposure.
///
/// Geometry: rays are traced by Embree in single precision relative to the specimen, the point on
/// the triangle found is then solved in double precision, so that edges lie within about 0.001 px
/// of their true place. The samples' pattern is fixed by the seed: same bytes for any number of
/// threads.
ImageF render_radiance(const PlacedScene& scene, const PreparedOptics& optics,
                       std::span<const double> table_angles_deg, const RenderOptions& options);

/// Exact truth for one view: along the ray through each pixel's centre from the centre of the
/// pupil.
struct ViewTruth {
  ImageF depth_mm;  ///< z in the camera frame; 0 where there is only the backdrop
  Image8 object;    ///< SceneObject
};
ViewTruth render_truth(const PlacedScene& scene, const PreparedOptics& optics,
                       double table_angle_deg, int threads);

}  // namespace skullstation
