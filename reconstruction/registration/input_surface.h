#pragma once

#include <vector>

#include "core/result.h"
#include "core/triangle_mesh.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

/// A point of the input that a template's vertex may go to.
struct InputHit {
  bool valid = false;
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  Eigen::Vector3d normal = Eigen::Vector3d::UnitZ();
  double distance_mm = 0.0;
};

/// A surface that templates are deformed onto, ready for searches from several threads.
class InputSurface {
 public:
  /// Samples about `spacing_mm` apart. Fails with `bad_input` for a mesh without area.
  static Result<InputSurface> make(TriangleMesh mesh, double spacing_mm, int threads);

  const TriangleMesh& mesh() const { return mesh_; }
  const OrientedPoints& samples() const { return samples_; }
  const PointTree& sample_tree() const { return sample_tree_; }

  /// The nearest sample whose normal is within the angle: of the nearest few.
  InputHit nearest_sample(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                          double max_distance_mm, double max_angle_deg) const;

  /// The same among the samples where the surface bends most (30 %).
  InputHit nearest_ridge(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                         double max_distance_mm, double max_angle_deg) const;

  /// The nearest point of the surface; not valid at the edge of a hole, too far away, or where the
  /// normal disagrees.
  InputHit nearest_point(const Eigen::Vector3d& position, const Eigen::Vector3d& normal,
                         double max_distance_mm, double max_angle_deg) const;

 private:
  InputSurface(TriangleMesh mesh, OrientedPoints samples, int threads);

  TriangleMesh mesh_;
  TriangleBvh bvh_;
  std::vector<bool> at_hole_;  ///< triangles with a corner on the edge of a hole
  OrientedPoints samples_;
  PointTree sample_tree_;
  OrientedPoints ridges_;
  PointTree ridge_tree_;
};

}  // namespace skullstation
