#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/mesh/decimation.h"
#include "reconstruction/volume/skin_field.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

struct CtSurfaceOptions {
  int skin_hu = -200;   ///< Gietzen et al. 2019
  int bone_hu = 600;    ///< Gietzen et al. 2019
  int metal_hu = 2000;  ///< what may be metal in the teeth
  /// The volume is cut this far below the mandible's lowest point.
  double crop_below_mandible_mm = 10.0;
  bool crop = true;
  double longest_spike_mm = 3.0;  ///< that a metal streak may leave outside the teeth
  OpeningSealOptions seal;
  DecimationOptions decimation;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

/// What may make a scan unfit for model generation.
enum class CtWarning {
  cropped_vertex,
  cropped_nose,
  cropped_side,
  no_mandible,
  thick_slices,
  metal_streaks,
  compressed_tissue,
  spine_not_separated,
  open_surface
};

/// "cropped vertex", "metal streaks", ...
const char* to_string(CtWarning warning);

struct CtFinding {
  CtWarning warning = CtWarning::thick_slices;
  std::string text;  ///< a sentence with its figures
};

/// How the surfaces came about; all figures that a report shows.
struct CtQuality {
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Zero();
  std::vector<CtFinding> findings;
  /// Patient z below which the volume was cut; nothing if it was not.
  std::optional<double> crop_z_mm;
  /// The mandible's most posterior point in the slices (patient, mm), where there is a mandible.
  std::optional<Eigen::Vector3d> mandible_most_posterior_mm;
  /// First and last slice of each stack with metal streaks, in the volume as it was given.
  std::vector<StreakedSlices> streaks;
  int bone_parts_kept = 0;
  int bone_parts_removed = 0;
  bool mandible_apart = false;
  double spine_removed_mm3 = 0.0;
  double surroundings_removed_mm3 = 0.0;  ///< head rest, table, cables
  double contact_front_mm2 = 0.0;
  double contact_back_mm2 = 0.0;
  int skull_components = 0;  ///< of the mesh
  /// Openings through the bone surface (its genus): foramina, and walls too thin for the threshold.
  long skull_openings = 0;
  int skin_components = 0;
  bool skull_closed_manifold = false;
  bool skin_closed_manifold = false;
};

struct CtSurfaces {
  TriangleMesh skull;  ///< patient coordinates, mm, outward, with normals
  TriangleMesh skin;
  CtQuality quality;
  /// The scan turned to the patient's axes and cropped: what the surfaces were made from.
  Volume volume;
  int first_slice = 0;  ///< of it, in the volume before it was cropped
};

/// Bone and skin surfaces of a head scan. The volume is turned to the patient's axes and cut below
/// the mandible, head rest and table are removed, metal streaks cut back; of the bone, skull and
/// mandible are kept, spine and loose inner parts not, and cavities without a way out are filled;
/// of the skin, the outside alone. Both are closed manifolds, thinned to uniform edges. The same
/// for any number of threads. Fails with `bad_input` for values that can't be Hounsfield units,
/// `no_result` where there is no head or no bone, `cancelled` on request.
Result<CtSurfaces> extract_ct_surfaces(Volume volume, const CtSurfaceOptions& options,
                                       const Progress& progress = {});

}  // namespace skullstation
