#include "reconstruction/phantom/specimen.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "core/random.h"
#include "reconstruction/phantom/bone_warp.h"

namespace skullstation {

using Eigen::Vector3d;

namespace {

constexpr double kCalvariaAboveGlabella_mm = 15.0;
constexpr double kHoleRadius_mm = 15.0;

/// Random values in [0, 1) on a cubic lattice, smoothly interpolated.
double value_noise(const Vector3d& point, double spacing_mm, std::uint64_t seed) {
  const Vector3d place = point / spacing_mm;
  const Vector3d cell = place.array().floor();
  const Vector3d part = place - cell;
  const Vector3d share = part.array().square() * (3.0 - 2.0 * part.array());
  double value = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    double weight = 1.0;
    std::uint64_t hash = seed;
    for (int axis = 0; axis < 3; ++axis) {
      const int step = corner >> axis & 1;
      weight *= step == 1 ? share[axis] : 1.0 - share[axis];
      hash = mix(hash, static_cast<std::uint64_t>(static_cast<std::int64_t>(cell[axis]) + step));
    }
    value += weight * Random(hash).uniform();
  }
  return value;
}

Colors stained(const Points3& vertices, std::uint64_t seed) {
  const Vector3d ivory(232.0, 219.0, 190.0);
  const Vector3d brown(128.0, 92.0, 58.0);
  Colors colors(vertices.rows(), 3);
  for (Eigen::Index v = 0; v < vertices.rows(); ++v) {
    const Vector3d point = vertices.row(v);
    const double stain = 0.45 * value_noise(point, 25.0, mix(seed, 1)) +
                         0.3 * value_noise(point, 6.0, mix(seed, 2)) +
                         0.25 * value_noise(point, 1.5, mix(seed, 3));
    const Vector3d color = ivory + std::clamp(2.0 * stain - 0.5, 0.0, 1.0) * (brown - ivory);
    colors.row(v) = color.array().round().cast<std::uint8_t>().transpose();
  }
  return colors;
}

/// The mesh of the vertices that are kept, and the triangles between them.
TriangleMesh kept(const TriangleMesh& mesh, const std::vector<bool>& keep) {
  std::vector<int> number(keep.size(), -1);
  int count = 0;
  for (std::size_t v = 0; v < keep.size(); ++v) {
    if (keep[v]) number[v] = count++;
  }
  TriangleMesh result;
  result.vertices.resize(count, 3);
  result.normals.resize(count, 3);
  for (std::size_t v = 0; v < keep.size(); ++v) {
    if (!keep[v]) continue;
    result.vertices.row(number[v]) = mesh.vertices.row(static_cast<Eigen::Index>(v));
    result.normals.row(number[v]) = mesh.normals.row(static_cast<Eigen::Index>(v));
  }
  result.triangles.resize(mesh.triangles.rows(), 3);
  Eigen::Index triangles = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const Eigen::RowVector3i corners(number[mesh.triangles(t, 0)], number[mesh.triangles(t, 1)],
                                     number[mesh.triangles(t, 2)]);
    if (corners.minCoeff() >= 0) result.triangles.row(triangles++) = corners;
  }
  result.triangles.conservativeResize(triangles, 3);
  return result;
}

}  // namespace

Result<void> add_damage(SpecimenDamage& damage, std::string_view word) {
  const std::pair<std::string_view, bool SpecimenDamage::*> words[] = {
      {"missing-mandible", &SpecimenDamage::missing_mandible},
      {"missing-calvaria", &SpecimenDamage::missing_calvaria},
      {"hole", &SpecimenDamage::hole}};
  for (const auto& [name, member] : words) {
    if (word != name) continue;
    damage.*member = true;
    return {};
  }
  return fail(ErrorKind::usage, "damage", "'" + std::string(word) + "' is not known",
              "use missing-mandible, missing-calvaria or hole");
}

TriangleMesh specimen(const Person& person, const SpecimenDamage& damage, std::uint64_t seed) {
  const auto at = [&](const char* name) {
    return person.bone.landmarks[landmark_index(person.bone.landmarks, name)].position_mm;
  };
  const double top_mm = at("glabella").z() + kCalvariaAboveGlabella_mm;
  const Vector3d hole = 0.5 * (at("euryon left") + at("vertex"));
  // From the midline outwards, so that the hole goes through both tables of the bone beyond it.
  const Vector3d axis = (hole - Vector3d(0.0, hole.y(), 0.0)).normalized();
  std::vector<bool> keep(static_cast<std::size_t>(person.skull.vertices.rows()), true);
  for (std::size_t v = 0; v < keep.size(); ++v) {
    const Vector3d place = person.skull.vertices.row(static_cast<Eigen::Index>(v));
    const bool of_mandible = static_cast<Eigen::Index>(v) >= person.cranium_vertices;
    const Vector3d off = place - hole;
    const bool in_hole =
        off.dot(axis) > -10.0 && (off - off.dot(axis) * axis).norm() < kHoleRadius_mm;
    keep[v] = !(damage.missing_mandible && of_mandible) &&
              !(damage.missing_calvaria && place.z() > top_mm) &&
              !(damage.hole && in_hole && !of_mandible);
  }
  TriangleMesh mesh = kept(person.skull, keep);
  mesh.colors = stained(mesh.vertices, seed);
  return mesh;
}

}  // namespace skullstation
