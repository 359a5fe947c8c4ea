#include "reconstruction/registration/oriented_points.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "reconstruction/distance/surface_samples.h"

namespace skullstation {

namespace {

/// What is averaged into one point: the same cube, and normals along the same axis.
using Cell = std::array<int, 4>;

int dominant_direction(const Eigen::Vector3d& normal) {
  Eigen::Index axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return static_cast<int>(2 * axis + (normal[axis] < 0.0 ? 1 : 0));
}

struct CellSample {
  Cell cell;
  int sample;
};

}  // namespace

Result<OrientedPoints> oriented_samples(const TriangleMesh& mesh, double spacing_mm) {
  if (!(surface_area(mesh) > 0.0)) return fail(ErrorKind::bad_input, "mesh", "has no surface");
  const auto samples = sample_surface(mesh, 4.0 / (spacing_mm * spacing_mm));
  if (!samples) return forward(samples);

  const auto normal_of = [&](const SurfaceSample& sample) {
    const Eigen::RowVector3i corner = mesh.triangles.row(sample.triangle);
    const Eigen::Vector3d a = mesh.vertices.row(corner[0]);
    const Eigen::Vector3d b = mesh.vertices.row(corner[1]);
    const Eigen::Vector3d c = mesh.vertices.row(corner[2]);
    return Eigen::Vector3d((b - a).cross(c - a).stableNormalized());
  };
  std::vector<CellSample> order;
  for (std::size_t i = 0; i < samples->size(); ++i) {
    const SurfaceSample& sample = (*samples)[i];
    const Eigen::Array3i cube = (sample.point.array() / spacing_mm).floor().cast<int>();
    order.push_back({{cube.x(), cube.y(), cube.z(), dominant_direction(normal_of(sample))},
                     static_cast<int>(i)});
  }
  std::sort(order.begin(), order.end(), [](const CellSample& a, const CellSample& b) {
    return std::pair(a.cell, a.sample) < std::pair(b.cell, b.sample);
  });

  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> normals;
  for (std::size_t begin = 0; begin < order.size();) {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d normal = Eigen::Vector3d::Zero();
    double area = 0.0;
    std::size_t end = begin;
    for (; end < order.size() && order[end].cell == order[begin].cell; ++end) {
      const SurfaceSample& sample = (*samples)[static_cast<std::size_t>(order[end].sample)];
      position += sample.area_mm2 * sample.point;
      normal += sample.area_mm2 * normal_of(sample);
      area += sample.area_mm2;
    }
    positions.push_back(position / area);
    normals.push_back(normal.stableNormalized());
    begin = end;
  }

  OrientedPoints points;
  points.positions.resize(static_cast<Eigen::Index>(positions.size()), 3);
  points.normals.resize(points.positions.rows(), 3);
  for (std::size_t i = 0; i < positions.size(); ++i) {
    points.positions.row(static_cast<Eigen::Index>(i)) = positions[i];
    points.normals.row(static_cast<Eigen::Index>(i)) = normals[i];
  }
  return points;
}

Result<OrientedPoints> oriented_samples_of_count(const TriangleMesh& mesh, int count) {
  const double area_mm2 = surface_area(mesh);
  if (!(area_mm2 > 0.0)) return fail(ErrorKind::bad_input, "mesh", "has no surface");
  // A plane passes about 1.5 cubes per square of their side; curved surfaces split some more.
  constexpr double cubes_per_square = 1.7;
  return oriented_samples(mesh, std::sqrt(cubes_per_square * area_mm2 / count));
}

OrientedPoints transformed(const Similarity3& transform, const OrientedPoints& points) {
  OrientedPoints moved = points;
  const Eigen::Matrix3d rotation = transform.rotation.toRotationMatrix();
  moved.positions = (transform.scale * points.positions * rotation.transpose()).rowwise() +
                    transform.translation.transpose();
  moved.normals = points.normals * rotation.transpose();
  return moved;
}

}  // namespace skullstation
