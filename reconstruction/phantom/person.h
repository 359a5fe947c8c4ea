#pragma once

#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/phantom/bone_warp.h"
#include "reconstruction/phantom/face_warp.h"
#include "reconstruction/phantom/person_parameters.h"

namespace skullstation {

/// A synthetic person whose anatomy is exactly known, in the person's own anatomical frame [mm].
/// Triangles and vertices correspond across all people of one PersonMaker.
struct Person {
  PersonParameters parameters;
  BoneWarp bone;
  FaceWarp face;
  TriangleMesh skull;  ///< both bones: the cranium's vertices and triangles, then the mandible's
  Eigen::Index cranium_vertices = 0;
  TriangleMesh skin;
};

/// Makes people: meshes the canonical head once and warps it many times.
class PersonMaker {
 public:
  /// Meshes with edges of about `edge_mm`, in [0.5, 5].
  PersonMaker(double edge_mm, int threads);

  /// The same bytes for any number of threads.
  Person make(const PersonParameters& parameters, int threads) const;

 private:
  PersonMaker(const SkullMeshes& skull, double edge_mm, int threads);

  TriangleMesh skull_;
  Eigen::Index cranium_vertices_ = 0;
  TriangleMesh skin_;
  BoneWarpModel bone_model_;
  FaceWarpModel face_model_;
};

/// True facial soft tissue thickness: the distance from every vertex of the skull to the nearest
/// point of the skin [mm] (Aspert et al. 2002), inner surfaces of the bone included.
std::vector<double> skull_to_skin_mm(const Person& person, int threads);

}  // namespace skullstation
