#include "reconstruction/registration/skull_template.h"

#include <fmt/format.h>

#include <array>

namespace skullstation {

namespace {

struct RegionFacts {
  std::string_view name;
  SkullBone bone;
  bool facial;
};

constexpr std::array<RegionFacts, kSkullRegionCount> kRegions = {{
    {"calvaria", SkullBone::cranium, false},
    {"occiput", SkullBone::cranium, false},
    {"base", SkullBone::cranium, false},
    {"temporal left", SkullBone::cranium, false},
    {"temporal right", SkullBone::cranium, false},
    {"zygoma left", SkullBone::cranium, true},
    {"zygoma right", SkullBone::cranium, true},
    {"orbit left", SkullBone::cranium, true},
    {"orbit right", SkullBone::cranium, true},
    {"nose", SkullBone::cranium, true},
    {"maxilla", SkullBone::cranium, true},
    {"upper teeth", SkullBone::cranium, true},
    {"chin", SkullBone::mandible, true},
    {"mandible body left", SkullBone::mandible, true},
    {"mandible body right", SkullBone::mandible, true},
    {"ramus left", SkullBone::mandible, true},
    {"ramus right", SkullBone::mandible, true},
    {"lower teeth", SkullBone::mandible, true},
}};

const RegionFacts& facts(SkullRegion region) { return kRegions[static_cast<std::size_t>(region)]; }

bool in_range(const SurfacePoint& point, int count) {
  return (point.corners.array() >= 0).all() && (point.corners.array() < count).all();
}

}  // namespace

std::string_view to_string(SkullRegion region) { return facts(region).name; }

SkullBone bone_of(SkullRegion region) { return facts(region).bone; }

bool is_facial(SkullRegion region) { return facts(region).facial; }

bool is_tooth(SkullRegion region) {
  return region == SkullRegion::upper_teeth || region == SkullRegion::lower_teeth;
}

Result<void> SkullTemplate::validate() const {
  const auto bad = [](std::string what) {
    return fail(ErrorKind::bad_input, "skull template", std::move(what), "make it again");
  };
  const auto count = static_cast<int>(vertices.rows());
  if (count < 4 || boundary_count < 4 || boundary_count > count) {
    return bad(fmt::format("{} vertices, {} of them on the surface", count, boundary_count));
  }
  if (!vertices.allFinite()) return bad("a vertex is not a number");
  if (static_cast<int>(region.size()) != count ||
      static_cast<int>(outer.size()) != boundary_count ||
      static_cast<int>(mirror.size()) != boundary_count) {
    return bad("its tables are not as long as its vertices are many");
  }
  if (tetrahedra.rows() == 0 || tetrahedra.minCoeff() < 0 || tetrahedra.maxCoeff() >= count) {
    return bad("a tetrahedron's corner is out of range");
  }
  if (boundary.rows() == 0 || boundary.minCoeff() < 0 || boundary.maxCoeff() >= boundary_count) {
    return bad("a surface triangle's corner is out of range");
  }
  if (signed_volumes(tetrahedra, vertices).minCoeff() <= 0.0) {
    return bad("a tetrahedron has no volume");
  }
  for (const SkullRegion r : region) {
    if (static_cast<int>(r) >= kSkullRegionCount) return bad("an unknown region");
  }
  for (const SurfacePoint& point : mirror) {
    if (!in_range(point, boundary_count)) return bad("a mirror partner is out of range");
  }
  for (const TemplateLandmark& landmark : landmarks) {
    if (!in_range(landmark.place, boundary_count)) return bad(landmark.name + " is out of range");
  }
  return {};
}

TriangleMesh surface_of(const SkullTemplate& skull, const Points3& vertices) {
  TriangleMesh mesh;
  mesh.vertices = vertices.topRows(skull.boundary_count);
  mesh.triangles = skull.boundary;
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

Eigen::VectorXd signed_volumes(const Tetrahedra& tetrahedra, const Points3& vertices) {
  Eigen::VectorXd volumes(tetrahedra.rows());
  for (Eigen::Index t = 0; t < tetrahedra.rows(); ++t) {
    const Eigen::Vector3d a = vertices.row(tetrahedra(t, 0));
    const Eigen::Vector3d b = vertices.row(tetrahedra(t, 1));
    const Eigen::Vector3d c = vertices.row(tetrahedra(t, 2));
    const Eigen::Vector3d d = vertices.row(tetrahedra(t, 3));
    volumes[t] = (b - a).cross(c - a).dot(d - a) / 6.0;
  }
  return volumes;
}

Points3 mirrored_surface(const SkullTemplate& skull, const Points3& vertices) {
  Points3 result(skull.boundary_count, 3);
  for (int v = 0; v < skull.boundary_count; ++v) {
    result.row(v) = skull.mirror[static_cast<std::size_t>(v)].position(vertices).transpose();
    result(v, 0) = -result(v, 0);
  }
  return result;
}

}  // namespace skullstation
