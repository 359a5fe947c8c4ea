#include "reconstruction/rendering/picture_camera.h"

#include <algorithm>

namespace skullstation {

namespace {

constexpr double margin = 1.06;
/// In diameters of what is seen: near enough for depth, far enough for true proportions.
constexpr double viewing_distance = 4.5;

}  // namespace

PictureCamera look_at(std::span<const TriangleMesh* const> meshes, const Eigen::Vector3d& from,
                      const Eigen::Vector3d& up, double aspect) {
  Eigen::AlignedBox3d box;
  for (const TriangleMesh* mesh : meshes) box.extend(bounding_box(*mesh));

  PictureCamera camera;
  camera.target_mm = box.center();
  camera.distance_mm = viewing_distance * std::max(box.diagonal().norm(), 1e-3);
  const Eigen::Vector3d toward = from.normalized();
  const Eigen::Vector3d right = up.cross(toward).normalized();
  camera.axes.row(0) = right;
  camera.axes.row(1) = toward.cross(right);
  camera.axes.row(2) = toward;

  Eigen::AlignedBox2d seen;
  for (const TriangleMesh* mesh : meshes) {
    for (Eigen::Index v = 0; v < mesh->vertices.rows(); ++v) {
      const Eigen::Vector3d local =
          camera.axes * (mesh->vertices.row(v).transpose() - camera.target_mm);
      seen.extend(
          Eigen::Vector2d(local.head<2>() * camera.distance_mm / (camera.distance_mm - local.z())));
    }
  }
  camera.middle_mm = seen.center();
  camera.height_mm = margin * std::max({seen.sizes().y(), seen.sizes().x() / aspect, 1e-3});
  return camera;
}

}  // namespace skullstation
