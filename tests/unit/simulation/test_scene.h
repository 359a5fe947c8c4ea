#pragma once

#include <Eigen/Core>
#include <memory>

#include "capture/simulation/placement.h"
#include "capture/simulation/render.h"
#include "capture/simulation/scene.h"
#include "core/triangle_mesh.h"

namespace skullstation::testing {

/// A closed box around the origin, edges along the axes, two triangles a side, vertices shared.
TriangleMesh box_mesh(const Eigen::Vector3d& size_mm);

/// A sphere around the origin, from an octahedron whose edges were halved `halvings` times.
TriangleMesh sphere_mesh(double radius_mm, int halvings);

/// The same mesh with one colour.
TriangleMesh painted(TriangleMesh mesh, const Eigen::Vector3i& srgb);

/// Nothing but the specimen in front of the backdrop, lit from the front by one lamp, without
/// ambient light or gloss: its light is a smooth function of the place.
SceneOptions plain_room();

/// Sky light alone: every upright wall has the same light everywhere, so that a picture's steps are
/// outlines and nothing else.
SceneOptions even_room();

/// As plain_room(), with a board of 7 x 7 large squares on the platter.
SceneOptions board_room();

std::shared_ptr<SimulatedScene> make_scene(const TriangleMesh& specimen,
                                           const Rigid3& table_from_specimen,
                                           const SceneOptions& options);

/// A sharp camera (a pinhole without vignetting), 160 x 120, 650 mm from the point 50 mm above the
/// table, straight from the front (azimuth -90 deg) at the given elevation.
CameraOptics small_optics(double elevation_deg = 0.0);

PreparedOptics prepared(const CameraOptics& optics);

/// Image point of a point of the table frame, by the lens and the pose alone.
Eigen::Vector2d project(const CameraOptics& optics, double table_angle_deg,
                        const Eigen::Vector3d& x_table);

/// One picture of the table at rest, two threads.
ImageF picture(const SimulatedScene& scene, const CameraOptics& optics, double table_angle_deg);

}  // namespace skullstation::testing
