#pragma once

#include <Eigen/Core>

#include "capture/simulation/placed_scene.h"

namespace skullstation {

/// A ray of sight in the table frame [mm] with what tells the size of a sensor element.
struct SightRay {
  Eigen::Vector3d origin;
  Eigen::Vector3d direction;  ///< unit length
  /// How the direction changes over the filter's width along the image's x and y.
  Eigen::Vector3d direction_dx;
  Eigen::Vector3d direction_dy;
};

/// Where a ray ends.
struct ShadingPoint {
  SceneObject object = SceneObject::backdrop;
  double distance_mm = 0.0;
  Eigen::Vector3d x_table;
  Eigen::Vector3d normal;         ///< for shading; unit, table frame, towards the viewer
  Eigen::Vector3d flat_normal;    ///< of the triangle or plane
  Eigen::Vector3d shadow_origin;  ///< where rays to the lamps begin
  Eigen::Vector3f albedo;         ///< linear RGB; of the backdrop: its radiance
  Eigen::Vector3f ambient;        ///< radiance that the ambient light leaves
  float gloss = 0.0F;
  bool on_table_top = false;  ///< the specimen's shade there is known (TableMap)
};

/// What the ray hits of the platter and the board, its place, normals and object; the backdrop if
/// nothing.
ShadingPoint hit_table(const PlacedScene& scene, const SightRay& ray);

/// Adds colour and ambient light to a hit on platter, board or backdrop. The backdrop stands still
/// while the table turns, by the angle of the given cosine and sine.
void color_table(const PlacedScene& scene, const SightRay& ray, double cos_table, double sin_table,
                 ShadingPoint& point);

/// The point for a hit on the specimen. \pre hit.triangle >= 0
ShadingPoint specimen_point(const PlacedScene& scene,
                            const Eigen::Matrix3d& table_rotation_specimen, const SightRay& ray,
                            const SpecimenHit& hit);

}  // namespace skullstation
