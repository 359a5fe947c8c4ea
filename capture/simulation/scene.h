#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// What a pixel shows.
enum class SceneObject : std::uint8_t { backdrop = 0, platter = 1, board = 2, specimen = 3 };

/// A rectangular lamp with a diffuser. It stands still in the room.
struct SoftBox {
  Eigen::Vector3d centre_mm = Eigen::Vector3d::Zero();  ///< station frame
  Eigen::Vector3d target_mm = Eigen::Vector3d::Zero();  ///< the point it faces, station frame
  double width_mm = 500.0;
  double height_mm = 500.0;
  /// Radiance of a white diffuser at the target that faces the lamp, other lights off. 1 is the
  /// sensor's full scale at its reference exposure (sensor.h).
  double strength = 0.5;
};

/// The look of bone where the specimen's mesh has no colours: a solid texture, a function of the
/// point in specimen coordinates (bone_texture.h). Each strength is a factor on the default look.
struct BoneLook {
  std::uint64_t seed = 1;
  double stains = 1.0;
  double pores = 1.0;
  double sutures = 1.0;
  double speckle = 1.0;  ///< from 8 mm down to 0.2 mm: what stereo matching holds on to
};

/// Everything in the room but the cameras. Frames: `station` stands still, its origin on the
/// table's axis in the board's plane, z up; `table` is turned against it by the table's angle,
/// x_station = rotation_about_z(angle_deg) * x_table; `specimen` is the mesh's own.
struct SceneOptions {
  std::optional<CharucoBoard> board = CharucoBoard{};
  Rigid3 table_from_board;           ///< z = 0 of the board frame is its printed face
  double board_border_mm = 5.0;      ///< white paper around the print
  double board_thickness_mm = 2.0;   ///< of the plate that the print is glued to
  bool platter = true;               ///< false: nothing under the board (it is held in the hand)
  double platter_radius_mm = 265.0;  ///< its top lies under the board's plate
  double platter_thickness_mm = 15.0;
  std::vector<SoftBox> lights = default_lights();  ///< 8 at most
  double ambient = 0.22;  ///< radiance of the zenith; falls to a third of it at the horizon
  BoneLook bone;
  double gloss = 0.04;    ///< strength of the bone's highlight; 0: purely diffuse
  int ambient_rays = 32;  ///< per mesh vertex, for the ambient light's occlusion

  Result<void> validate() const;
  /// A key light and a weaker fill on either side of a camera at azimuth -90 deg.
  static std::vector<SoftBox> default_lights();
};

struct PlacedScene;

/// A specimen on the station's table, photographed by any number of cameras. All members may be
/// called from several threads: a picture shows the scene as it was when its rendering began.
class SimulatedScene {
 public:
  /// Builds the ray tracing structures. The mesh (mm) may be empty (a bare table) and is shown
  /// with its vertex colours if it has any. Triangles with long edges are divided for shading;
  /// the surface stays the same. Errors (bad_input): coordinates that are not finite, indices out
  /// of range, options that make no sense.
  static Result<std::shared_ptr<SimulatedScene>> build(const TriangleMesh& specimen,
                                                       const Rigid3& table_from_specimen,
                                                       const SceneOptions& options, int threads);

  /// What the operator does between two passes: turns the specimen over, or takes it away
  /// (nothing). Computes the ambient light on the surfaces anew: seconds for a large mesh.
  void set_specimen_pose(const std::optional<Rigid3>& table_from_specimen);
  void set_board_pose(const Rigid3& table_from_board);

  std::optional<Rigid3> specimen_pose() const;
  Rigid3 board_pose() const;

  /// The scene as it is now; for the renderer.
  std::shared_ptr<const PlacedScene> placed() const;

  ~SimulatedScene();
  SimulatedScene(const SimulatedScene&) = delete;
  SimulatedScene& operator=(const SimulatedScene&) = delete;

 private:
  struct State;
  explicit SimulatedScene(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace skullstation
