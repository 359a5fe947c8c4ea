#pragma once

#include <Eigen/Core>
#include <span>
#include <vector>

#include "capture/simulation/placed_scene.h"
#include "capture/simulation/table_map.h"

namespace skullstation {

/// A lamp with its directions, station frame.
struct Lamp {
  Eigen::Vector3d centre;
  Eigen::Vector3d facing;
  Eigen::Vector3d half_width;
  Eigen::Vector3d half_height;
  double strength;          ///< SoftBox::strength
  double strength_at_1_mm;  ///< the same, 1 mm from the lamp

  /// The point of its surface for a point of the unit square.
  Eigen::Vector3d at(const Eigen::Vector2f& sample) const {
    return centre + (2.0 * static_cast<double>(sample.x()) - 1.0) * half_width +
           (2.0 * static_cast<double>(sample.y()) - 1.0) * half_height;
  }
};

std::vector<Lamp> make_lamps(std::span<const SoftBox> boxes);

/// For each lamp, how much of it the specimen leaves to the table's top at the given angle. Found
/// once for a picture, since it changes slowly from place to place: smooth penumbrae on the board
/// for a fraction of the rays. Empty maps if there is no specimen.
std::vector<TableMap> lamps_seen_from_table(const PlacedScene& scene, std::span<const Lamp> lamps,
                                            double table_angle_deg, int threads);

}  // namespace skullstation
