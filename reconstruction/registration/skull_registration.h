#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"
#include "reconstruction/registration/fit_report.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

/// The energy that keeps the template's shape (METHOD: measured comparison in
/// docs/registration.md).
enum class SkullRegularizer {
  smooth,            ///< bi-Laplacian of the displacement, with the projected volume term
  projected_volume,  ///< ShapeOp's volume constraint (Deuss et al. 2015)
  volume             ///< the paper's: squared change of each tetrahedron's volume
};

struct SkullRegistrationOptions {
  SkullRegularizer regularizer = SkullRegularizer::smooth;
  bool unit_unknown = false;  ///< look for the scale, too, before anything else
  /// The start (input_from_template), if it is known; otherwise it is found.
  const Similarity3* start = nullptr;
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

struct SkullFitQuality {
  FitDistances facial;               ///< vertices of the input's facial area, to the fitted surface
  FitDistances facial_bone;          ///< those that lie on no tooth
  FitDistances outer;                ///< all outer vertices of the input, to the fitted surface
  int inverted_tetrahedra = 0;       ///< never more than 0
  double least_scaled_volume = 0.0;  ///< least volume of a tetrahedron in units of its rest volume
  double observed_share = 0.0;       ///< of the template's outer surface
  double mandible_observed_share = 0.0;  ///< 0 if less than a fifth: then there is none
};

/// A template skull on an input skull.
struct FittedSkull {
  Points3 vertices;  ///< #V x 3 in the template's order, in the input's frame [mm]
  /// Best similarity between template and fit.
  Similarity3 input_from_template;
  /// Surface vertices (#boundary_count) that the input shows: outer, the input's surface is within
  /// 2 mm with a normal that agrees, and nearest to it lies the same place of the template.
  std::vector<bool> observed;
  std::vector<double> distance_mm;  ///< #boundary_count: to the input's surface
  SkullFitQuality quality;
  FitStages stages;
  /// What a person should know before using it: no mandible, much missing.
  std::vector<std::string> warnings;
};

/// Deforms the template onto the input skull (Gietzen et al. 2019): global pose, hierarchical ICP
/// over its parts, then non-rigid stages from stiff to soft. No tetrahedron is ever turned over.
/// The same bytes for any number of threads. Fails with `bad_input` for a mesh that can't be a
/// skull (no area, a handful of vertices, a wrong unit, a mirror image), `no_result` where no pose
/// fits, `cancelled` on request.
Result<FittedSkull> register_skull(const SkullTemplate& skull, const TriangleMesh& input,
                                   const SkullRegistrationOptions& options = {},
                                   const Progress& progress = {});

}  // namespace skullstation
