#include "reconstruction/phantom/person.h"

#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/canonical_skull.h"
#include "reconstruction/phantom/tooth_loss.h"

namespace skullstation {

namespace {

/// Fine enough to have the slit of the mouth.
constexpr double kSearchEdge_mm = 2.5;

template <class Move>
TriangleMesh moved(const TriangleMesh& mesh, int threads, const Move& move) {
  TriangleMesh result = mesh;
  parallel_for(static_cast<int>(mesh.vertices.rows()), threads, [&](int v) {
    result.vertices.row(v) = move(v, mesh.vertices.row(v).transpose()).transpose();
  });
  result.normals = vertex_normals(result);
  return result;
}

}  // namespace

PersonMaker::PersonMaker(double edge_mm, int threads)
    : PersonMaker(skull_meshes(skull_solids(), edge_mm, threads), edge_mm, threads) {}

PersonMaker::PersonMaker(const SkullMeshes& skull, double edge_mm, int threads)
    : skull_(whole_skull(skull)),
      cranium_vertices_(skull.cranium.vertices.rows()),
      skin_(canonical_skin(edge_mm, threads)),
      bone_model_(canonical_landmarks(), skull.cranium, canonical_skin_landmarks()),
      face_model_(skull, canonical_landmarks(), canonical_skin(kSearchEdge_mm, threads),
                  canonical_skin_landmarks()) {}

Person PersonMaker::make(const PersonParameters& parameters, int threads) const {
  Person person;
  person.parameters = parameters;
  person.bone = bone_model_.fit(parameters.craniometrics_mm, parameters.seed,
                                parameters.bone_freedom, threads);
  open_mandible(person.bone, parameters.mandible_opening_deg);
  person.face = face_model_.fit(parameters, person.bone, threads);
  const SpaceWarp& bone = person.bone.person_from_canonical;
  const SpaceWarp& face = person.face.face_from_canonical;
  const std::vector<int>& missing = parameters.missing_teeth;
  const TriangleMesh healed =
      missing.empty() ? TriangleMesh{}
                      : with_healed_sockets(skull_, cranium_vertices_, missing, threads);
  person.skull =
      moved(missing.empty() ? skull_ : healed, threads, [&](int v, const Eigen::Vector3d& vertex) {
        return person.bone.on_person(vertex, v >= cranium_vertices_);
      });
  person.cranium_vertices = cranium_vertices_;
  person.skin =
      moved(skin_, threads, [&](int, const Eigen::Vector3d& vertex) { return bone(face(vertex)); });
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
