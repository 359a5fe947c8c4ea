#include "reconstruction/registration/head_template.h"

#include <fmt/format.h>

#include <array>

namespace skullstation {

std::string_view to_string(HeadRegion region) {
  constexpr std::array<std::string_view, kHeadRegionCount> kNames = {
      "face", "nose", "lips", "eyes", "ears", "scalp", "neck"};
  return kNames[static_cast<std::size_t>(region)];
}

bool is_facial(HeadRegion region) {
  return region == HeadRegion::face || region == HeadRegion::nose || region == HeadRegion::lips ||
         region == HeadRegion::eyes;
}

bool rests_on_bone(HeadRegion region) {
  return region == HeadRegion::face || region == HeadRegion::scalp;
}

Result<void> HeadTemplate::validate() const {
  const auto bad = [](std::string what) {
    return fail(ErrorKind::bad_input, "head template", std::move(what), "make it again");
  };
  const auto count = static_cast<int>(vertices.rows());
  if (count < 4) return bad(fmt::format("{} vertices", count));
  if (!vertices.allFinite()) return bad("a vertex is not a number");
  if (static_cast<int>(region.size()) != count || static_cast<int>(mirror.size()) != count ||
      static_cast<int>(data_weight.size()) != count) {
    return bad("its tables are not as long as its vertices are many");
  }
  if (triangles.rows() == 0 || triangles.minCoeff() < 0 || triangles.maxCoeff() >= count) {
    return bad("a triangle's corner is out of range");
  }
  for (int v = 0; v < count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (static_cast<int>(region[at]) >= kHeadRegionCount) return bad("an unknown region");
    if (mirror[at] < 0 || mirror[at] >= count ||
        mirror[static_cast<std::size_t>(mirror[at])] != v) {
      return bad("mirror partners that are not each other's");
    }
    if (!(data_weight[at] >= 0.0 && data_weight[at] <= 1.0)) return bad("a weight outside [0, 1]");
  }
  for (const TemplateLandmark& landmark : landmarks) {
    if ((landmark.place.corners.array() < 0).any() ||
        (landmark.place.corners.array() >= count).any()) {
      return bad(landmark.name + " is out of range");
    }
  }
  return {};
}

TriangleMesh surface_of(const HeadTemplate& head, const Points3& vertices) {
  TriangleMesh mesh;
  mesh.vertices = vertices;
  mesh.triangles = head.triangles;
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

Points3 mirrored(const HeadTemplate& head, const Points3& vertices) {
  Points3 result(vertices.rows(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    result.row(v) = vertices.row(head.mirror[static_cast<std::size_t>(v)]);
    result(v, 0) = -result(v, 0);
  }
  return result;
}

}  // namespace skullstation
