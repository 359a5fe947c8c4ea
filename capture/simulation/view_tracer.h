#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "capture/simulation/lamps.h"
#include "capture/simulation/render.h"
#include "capture/simulation/surface_point.h"

namespace skullstation {

/// Light that arrives along one sample's ray, and what tells whether its pixel needs more samples.
struct TracedSample {
  Eigen::Vector3f radiance = Eigen::Vector3f::Zero();
  SceneObject object = SceneObject::backdrop;
  float light = 0.0F;           ///< on the surface as it is turned, shadows and texture left out
  std::uint8_t lamps_seen = 0;  ///< one bit for each lamp that was looked for and is visible
  std::uint8_t lamps_hidden = 0;
  std::uint8_t lamps_behind = 0;  ///< those that the surface turns its back to
};

/// A sample to be traced: which one of which pixel, and of how many (a power of two).
struct PixelSample {
  int x = 0;
  int y = 0;
  int index = 0;
  int count = 1;
};

/// Traces samples of one view. One for each thread: it keeps buffers between calls.
class ViewTracer {
 public:
  /// `lamps_seen` as of lamps_seen_from_table().
  ViewTracer(const PlacedScene& scene, const PreparedOptics& optics, std::span<const Lamp> lamps,
             std::span<const TableMap> lamps_seen, std::span<const double> table_angles_deg,
             const RenderOptions& options);

  /// The light of each sample; `traced` is as long as `samples`. With `lamps_in_turn` each sample
  /// looks for every other lamp only, and what it finds counts twice: as good where each lamp is
  /// either seen or hidden by all samples of a pixel, at half the cost.
  void trace(std::span<const PixelSample> samples, bool lamps_in_turn,
             std::span<TracedSample> traced);

 private:
  struct Sight {
    SightRay ray;  // table frame
    double cos_table = 1.0;
    double sin_table = 0.0;
    std::uint64_t pixel_hash = 0;
  };
  Sight sight(const PixelSample& sample) const;
  double table_angle_deg(double time) const;
  void add_lamps(const ShadingPoint& point, const Sight& sight, const PixelSample& sample,
                 std::size_t sample_number, bool lamps_in_turn, TracedSample& traced);

  const PlacedScene& scene_;
  const PreparedOptics& optics_;
  std::span<const Lamp> lamps_;
  std::span<const TableMap> lamps_seen_;
  std::vector<double> table_angles_deg_;
  RenderOptions options_;
  bool moving_ = false;
  double still_cos_ = 1.0;
  double still_sin_ = 0.0;
  Rigid3 station_from_camera_;
  Rigid3 specimen_from_table_;
  Eigen::Matrix3d station_rotation_camera_;
  Eigen::Matrix3d table_rotation_specimen_ = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d specimen_rotation_table_ = Eigen::Matrix3d::Identity();

  // What a shadow ray takes from its sample if something is in its way.
  struct LampShadow {
    std::size_t sample_number;
    Eigen::Vector3f radiance;
    std::uint8_t lamp_bit;
  };
  std::vector<Sight> sights_;
  std::vector<ShadingPoint> points_;
  std::vector<SpecimenRay> rays_;
  std::vector<SpecimenHit> hits_;
  std::vector<SpecimenRay> shadow_rays_;
  std::vector<LampShadow> lamp_shadows_;
  std::vector<std::uint8_t> blocked_;
};

}  // namespace skullstation
