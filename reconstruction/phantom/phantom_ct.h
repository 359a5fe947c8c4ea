#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/phantom/tissue_map.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// Where a point of a person lies in the canonical head [mm].
struct CanonicalPlace {
  Eigen::Vector3d
      skull;  ///< if it is of bone; the canonical mandible is turned open like the person's
  Eigen::Vector3d soft;  ///< if it is of soft tissue
};

/// A person to be scanned, in patient coordinates (LPS) [mm]. All surfaces closed and outward.
struct PhantomBody {
  TriangleMesh bone;  ///< its surface is met by the 600 HU isosurface; may have several parts
  TriangleMesh skin;  ///< met by the -200 HU isosurface; holds the whole bone
  /// Carries a patient point to the canonical head, smoothly; called from several threads.
  std::function<CanonicalPlace(const Eigen::Vector3d& patient_mm)> canonical_from_patient;
  Rigid3 open_from_closed;  ///< how the canonical mandible is turned
};

struct PhantomCtOptions {
  Eigen::Vector3d spacing_mm{0.5, 0.5, 1.0};                ///< each in [0.2, 10]
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();  ///< unit columns: where i, j, k go
  double margin_mm = 12.0;                                  ///< air around the head, at least 0
  /// What is cut off the top of the head, as a short scan does; 0: nothing.
  double cropped_calvaria_mm = 0.0;
  /// What is cut off the front of the nose, as a narrow field of view does; 0: nothing.
  double cropped_nose_mm = 0.0;
  /// Full width at half maximum of the scanner's point spread function, besides that of the voxel;
  /// in [0, 5].
  double blur_fwhm_mm = 0.7;
  double noise_sd_hu = 10.0;  ///< white, in [0, 200]
  bool head_rest = false;     ///< a padded shell behind the head
  bool table = false;         ///< a plate under the head rest
  /// Dental fillings (patient, balls of 2.5 mm); each streaks over the slices it lies in.
  std::vector<Eigen::Vector3d> metal_mm;
  double streak_hu = 700.0;  ///< largest streaks beside the metal
  /// Outside the scanner's round field of view about the slices' centre; nothing: all is seen.
  std::optional<std::int16_t> padding_hu;
  std::uint64_t seed = 0;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

/// The CT volume of a person, in Hounsfield units. Air -1000, dermis 40, fat -100, muscle 55,
/// brain 35, eye 15, cortical bone 1500 down to trabecular 450 from 2.5 mm depth on, dentine 1700,
/// enamel 2500. Edges are those of the point spread function (voxel and scanner); the bodies'
/// borders lie so that the isosurfaces at 600 and -200 HU, and not those at the edges' half height,
/// meet the given surfaces where these are smooth (docs/phantom/skin.md). The same bytes for any
/// number of threads. Fails with `usage` for options out of range, `bad_input` for an empty or open
/// surface, `cancelled` on request.
Result<Volume> phantom_ct(const PhantomBody& body, const TissueMap& tissue,
                          const PhantomCtOptions& options, const Progress& progress = {});

}  // namespace skullstation
