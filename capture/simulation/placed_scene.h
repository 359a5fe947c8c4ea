#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "capture/simulation/board_print.h"
#include "capture/simulation/bone_texture.h"
#include "capture/simulation/sample_table.h"
#include "capture/simulation/scene.h"
#include "capture/simulation/specimen_surface.h"
#include "capture/simulation/table_map.h"
#include "core/transform.h"

namespace skullstation {

/// The room's cloth: a cylinder around the axis, dark, lit from above, with folds. It stands still
/// in the station frame. A picture of it, bilinear between its points.
class Backdrop {
 public:
  Backdrop();
  static constexpr double radius_mm = 1400.0;
  /// Radiance at a point of the cylinder.
  Eigen::Vector3f radiance(const Eigen::Vector3d& x_station) const;

 private:
  static constexpr int around = 880;
  static constexpr int rows = 260;
  static constexpr double lowest_mm = -1300.0;
  static constexpr double row_mm = 10.0;
  std::vector<float> light_;  // rows x (around + 1), upwards; the last column repeats the first
};

/// What of the scene never changes.
struct SceneParts {
  SceneOptions options;
  std::shared_ptr<const SpecimenSurface> surface;  ///< null: a bare table
  BoneTexture bone;
  std::optional<BoardPrint> print;
  SampleTable samples;
  Backdrop backdrop;
};

/// Light from everywhere but the lamps, in the unit of radiance that a white surface would send
/// back. Neutral from the room and the board, tinted from the bone itself.
struct Ambient {
  float neutral = 0.0F;
  float from_bone = 0.0F;
};

/// The scene at one moment: what the renderer sees. Never changed after it was made.
struct PlacedScene {
  std::shared_ptr<const SceneParts> parts;
  Rigid3 table_from_board;
  Eigen::Matrix3d board_rotation_table;  ///< as a matrix: every ray of sight needs it
  std::optional<Rigid3> table_from_specimen;
  std::vector<Ambient> vertex_ambient;  ///< per vertex of the shading mesh; empty: no specimen
  TableMap table_sky;  ///< how much of the sky the specimen leaves to the table's top
};

/// Radiance of the room in a direction (unit, z up) and the ambient light on a surface that sees
/// all of it, to its normal's side.
float sky_radiance(const SceneOptions& options, double direction_z);
float open_ambient(const SceneOptions& options, double normal_z);

/// Fills in vertex_ambient and table_sky by casting rays from every vertex. The ambient light does
/// not depend on the table's angle, since the room's own light is the same from all sides.
void compute_ambient(PlacedScene& scene, int threads);

}  // namespace skullstation
