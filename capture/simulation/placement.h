#pragma once

#include <Eigen/Geometry>

#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

/// Half a turn about x: the specimen lies upside down, its face still towards the same side.
Eigen::Quaterniond turned_over();

/// table_from_specimen of a specimen that stands on the table: turned by
/// `table_rotation_specimen`, its lowest point at z = 0 and the middle of its bounding box over
/// the axis. Whether it would tip over is not asked.
Rigid3 rest_on_table(const TriangleMesh& specimen,
                     const Eigen::Quaterniond& table_rotation_specimen);

/// camera_from_station of a camera at `eye` that looks at `target` with its image upright: z
/// forward, x right, y down, the station's +z up in the picture. Looking straight up or down, the
/// station's +y is up. Points in mm, station frame; they must differ.
Rigid3 camera_looking_at(const Eigen::Vector3d& eye, const Eigen::Vector3d& target);

/// The same for a camera at `distance_mm` from the target, `elevation_deg` above its horizon, in
/// the direction `azimuth_deg` (counter-clockwise from +x seen from above; -90 is the front of a
/// specimen that faces -y).
Rigid3 camera_on_ring(const Eigen::Vector3d& target, double distance_mm, double elevation_deg,
                      double azimuth_deg = -90.0);

}  // namespace skullstation
