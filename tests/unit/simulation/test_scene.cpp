#include "tests/unit/simulation/test_scene.h"

#include <array>
#include <map>
#include <stdexcept>
#include <utility>
#include <vector>

namespace skullstation::testing {

namespace {

TriangleMesh mesh_of(const std::vector<Eigen::Vector3d>& vertices,
                     const std::vector<std::array<int, 3>>& triangles) {
  TriangleMesh mesh;
  mesh.vertices.resize(static_cast<Eigen::Index>(vertices.size()), 3);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    mesh.vertices.row(static_cast<Eigen::Index>(v)) = vertices[v].transpose();
  }
  mesh.triangles.resize(static_cast<Eigen::Index>(triangles.size()), 3);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    const auto& [a, b, c] = triangles[t];
    mesh.triangles.row(static_cast<Eigen::Index>(t)) << a, b, c;
  }
  return mesh;
}

}  // namespace

TriangleMesh box_mesh(const Eigen::Vector3d& size_mm) {
  std::vector<Eigen::Vector3d> vertices;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d corner(i & 1, i >> 1 & 1, i >> 2 & 1);
    vertices.emplace_back((corner.array() - 0.5) * size_mm.array());
  }
  return mesh_of(vertices, {{0, 2, 3},
                            {0, 3, 1},
                            {4, 5, 7},
                            {4, 7, 6},
                            {0, 1, 5},
                            {0, 5, 4},
                            {2, 6, 7},
                            {2, 7, 3},
                            {0, 4, 6},
                            {0, 6, 2},
                            {1, 3, 7},
                            {1, 7, 5}});
}

TriangleMesh sphere_mesh(double radius_mm, int halvings) {
  std::vector<Eigen::Vector3d> vertices;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {1.0, -1.0}) vertices.emplace_back(side * Eigen::Vector3d::Unit(axis));
  }
  std::vector<std::array<int, 3>> triangles;
  for (int octant = 0; octant < 8; ++octant) {
    const std::array<int, 3> corners = {octant & 1, 2 + (octant >> 1 & 1), 4 + (octant >> 2 & 1)};
    // An odd number of negative sides turns the triangle round.
    const bool turned = ((octant & 1) + (octant >> 1 & 1) + (octant >> 2 & 1)) % 2 == 1;
    triangles.push_back(turned ? std::array<int, 3>{corners[0], corners[2], corners[1]} : corners);
  }
  for (int i = 0; i < halvings; ++i) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [found, added] =
          middles.try_emplace(std::minmax(a, b), static_cast<int>(vertices.size()));
      if (added) {
        const Eigen::Vector3d between = (vertices[a] + vertices[b]).normalized();
        vertices.push_back(between);
      }
      return found->second;
    };
    std::vector<std::array<int, 3>> halved;
    for (const auto& [a, b, c] : triangles) {
      const int ab = middle(a, b);
      const int bc = middle(b, c);
      const int ca = middle(c, a);
      halved.insert(halved.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(halved);
  }
  for (Eigen::Vector3d& vertex : vertices) vertex *= radius_mm;
  return mesh_of(vertices, triangles);
}

TriangleMesh painted(TriangleMesh mesh, const Eigen::Vector3i& srgb) {
  mesh.colors = srgb.cast<std::uint8_t>().transpose().replicate(mesh.vertices.rows(), 1);
  return mesh;
}

SceneOptions plain_room() {
  SceneOptions options;
  options.board.reset();
  options.platter = false;
  options.lights = {{{0.0, -900.0, 200.0}, {0.0, 0.0, 50.0}, 200.0, 200.0, 0.8}};
  options.ambient = 0.0;
  options.gloss = 0.0;
  return options;
}

SceneOptions even_room() {
  SceneOptions options = plain_room();
  options.lights.clear();
  options.ambient = 0.6;
  options.ambient_rays = 64;
  return options;
}

SceneOptions board_room() {
  SceneOptions options = plain_room();
  options.board = CharucoBoard{"DICT_5X5_1000", 7, 7, 50.0, 38.0};
  options.platter = true;
  options.lights = {{{0.0, -500.0, 900.0}, {0.0, 0.0, 0.0}, 200.0, 200.0, 0.8}};
  return options;
}

std::shared_ptr<SimulatedScene> make_scene(const TriangleMesh& specimen,
                                           const Rigid3& table_from_specimen,
                                           const SceneOptions& options) {
  auto scene = SimulatedScene::build(specimen, table_from_specimen, options, 2);
  if (!scene) throw std::runtime_error(scene.error().message());
  return *std::move(scene);
}

CameraOptics small_optics(double elevation_deg) {
  CameraOptics optics;
  optics.lens = Lens::from_params(160, 120, LensModel::pinhole, {320.0, 320.0, 80.7, 59.6});
  optics.camera_from_station = camera_on_ring({0.0, 0.0, 50.0}, 650.0, elevation_deg);
  optics.aperture_mm = 0.0;
  optics.vignetting = 0.0;
  return optics;
}

PreparedOptics prepared(const CameraOptics& optics) {
  auto result = PreparedOptics::prepare(optics, 2);
  if (!result) throw std::runtime_error(result.error().message());
  return *std::move(result);
}

Eigen::Vector2d project(const CameraOptics& optics, double table_angle_deg,
                        const Eigen::Vector3d& x_table) {
  return optics.lens.project(optics.camera_from_station *
                             (rotation_about_z(table_angle_deg) * x_table));
}

ImageF picture(const SimulatedScene& scene, const CameraOptics& optics, double table_angle_deg) {
  RenderOptions render;
  render.threads = 2;
  return render_radiance(*scene.placed(), prepared(optics), {&table_angle_deg, 1}, render);
}

}  // namespace skullstation::testing
