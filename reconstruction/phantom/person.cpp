#include "reconstruction/phantom/person.h"

#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

namespace {

/// Fine enough to find extremes and thin places on.
constexpr double kSearchEdge_mm = 4.0;

template <class Warp>
TriangleMesh warped(const TriangleMesh& mesh, const Warp& warp, int threads) {
  TriangleMesh result = mesh;
  parallel_for(static_cast<int>(mesh.vertices.rows()), threads, [&](int v) {
    const Eigen::Vector3d vertex = mesh.vertices.row(v);
    result.vertices.row(v) = warp(vertex).transpose();
  });
  result.normals = vertex_normals(result);
  return result;
}

}  // namespace

PersonMaker::PersonMaker(double edge_mm, int threads)
    : skull_(canonical_skull(edge_mm, threads)),
      skin_(canonical_skin(edge_mm, threads)),
      bone_model_(canonical_landmarks(), skull_),
      face_model_(canonical_skin_landmarks(), canonical_skin(kSearchEdge_mm, threads), skull_) {}

Person PersonMaker::make(const PersonParameters& parameters, int threads) const {
  Person person;
  person.parameters = parameters;
  person.bone = bone_model_.fit(parameters.craniometrics_mm, parameters.seed,
                                parameters.bone_freedom, threads);
  const SpaceWarp& bone = person.bone.person_from_canonical;
  person.skull = warped(skull_, bone, threads);
  person.face = face_model_.fit(parameters, person.bone, person.skull, threads);
  const SpaceWarp& face = person.face.person_from_carried;
  person.skin = warped(
      skin_, [&](const Eigen::Vector3d& point) { return face(bone(point)); }, threads);
  return person;
}

std::vector<double> skull_to_skin_mm(const Person& person, int threads) {
  const TriangleBvh skin(person.skin);
  std::vector<double> thickness(person.skull.vertices.rows());
  parallel_for(static_cast<int>(thickness.size()), threads, [&](int v) {
    thickness[v] = skin.closest(person.skull.vertices.row(v)).distance_mm;
  });
  return thickness;
}

}  // namespace skullstation
