#include "reconstruction/registration/input_check.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

namespace skullstation {

namespace {
constexpr int kLeastVertices = 500;
constexpr double kLeastSize_mm = 60.0;
constexpr double kGreatestSize_mm = 600.0;
constexpr int kDirections = 100;
}  // namespace

bool is_inside_out(const TriangleMesh& mesh) {
  const Points3 normals = vertex_normals(mesh);
  int outwards = 0;
  for (int i = 0; i < kDirections; ++i) {  // a spiral of points evenly over the sphere
    const double z = 1.0 - (2.0 * i + 1.0) / kDirections;
    const double turn = i * std::numbers::pi * (3.0 - std::sqrt(5.0));
    const double r = std::sqrt(1.0 - z * z);
    const Eigen::Vector3d direction(r * std::cos(turn), r * std::sin(turn), z);
    Eigen::Index extreme = 0;
    (mesh.vertices * direction).maxCoeff(&extreme);
    outwards += normals.row(extreme).dot(direction) >= 0.0 ? 1 : -1;
  }
  return outwards < 0;
}

Result<void> check_input(const TriangleMesh& mesh, const std::string& what, bool unit_unknown) {
  const auto bad = [&](std::string wrong, std::string advice) {
    return fail(ErrorKind::bad_input, what, std::move(wrong), std::move(advice));
  };
  if (mesh.vertices.rows() == 0 || mesh.triangles.rows() == 0) {
    return bad("the mesh is empty", "give a surface with triangles");
  }
  if (mesh.vertices.rows() < kLeastVertices) {
    return bad(fmt::format("{} vertices are no {}", mesh.vertices.rows(), what),
               fmt::format("give a surface of at least {} vertices", kLeastVertices));
  }
  if (!mesh.vertices.allFinite()) {
    return bad("a vertex is not a number", "write the mesh again from its source");
  }
  const double size_mm = bounding_box(mesh).diagonal().norm();
  if (!(size_mm > 0.0) || !(surface_area(mesh) > 0.0)) return bad("the mesh has no area", "");
  if (!unit_unknown && size_mm < kLeastSize_mm) {
    return bad(fmt::format("it measures {:.3g} mm from corner to corner", size_mm),
               "give it in mm (is it in metres, centimetres or inches?), or say that its unit is "
               "unknown");
  }
  if (!unit_unknown && size_mm > kGreatestSize_mm) {
    return bad(fmt::format("it measures {:.0f} mm from corner to corner", size_mm),
               "give it in mm and cropped to the head, or say that its unit is unknown");
  }
  if (is_inside_out(mesh)) {
    return bad("its triangles face inwards: mirrored, or turned inside out",
               "mirror it back, or turn its triangles round");
  }
  return {};
}

}  // namespace skullstation
