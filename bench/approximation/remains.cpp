#include "bench/approximation/remains.h"

#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {

namespace {

Eigen::Vector3d landmark(const Person& person, std::string_view name) {
  return person.bone.landmarks[landmark_index(person.bone.landmarks, name)].position_mm;
}

}  // namespace

std::string_view to_string(Remains remains) {
  switch (remains) {
    case Remains::complete: return "complete";
    case Remains::no_mandible: return "no mandible";
    case Remains::no_calvaria: return "no calvaria";
    case Remains::half_face: return "half a face";
  }
  return "";
}

TriangleMesh remains_of(const Person& person, Remains remains) {
  const TriangleMesh& skull = person.skull;
  if (remains == Remains::complete) return skull;
  const double porion_y = landmark(person, "porion left").y();
  const double calvaria_z = landmark(person, "glabella").z() + 15.0;
  return submesh(skull, [&](Eigen::Index t) {
    const Eigen::Vector3d center =
        skull.vertices(skull.triangles.row(t), Eigen::all).colwise().mean().transpose();
    if (remains == Remains::no_mandible) return skull.triangles(t, 0) < person.cranium_vertices;
    if (remains == Remains::no_calvaria) return center.z() < calvaria_z;
    const bool face = center.y() < porion_y && center.z() < calvaria_z;
    return !(face && center.x() > 0.0);  // +x is the person's left
  });
}

}  // namespace skullstation
