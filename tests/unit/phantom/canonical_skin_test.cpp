#include "reconstruction/phantom/canonical_skin.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include "core/random.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

const std::vector<Landmark>& skin_landmarks() {
  static const std::vector<Landmark> all = canonical_skin_landmarks();
  return all;
}

Vector3d at(const std::vector<Landmark>& landmarks, const std::string& name) {
  const auto found = std::ranges::find(landmarks, name, &Landmark::name);
  EXPECT_NE(found, landmarks.end()) << name;
  return found == landmarks.end() ? Vector3d(Vector3d::Constant(NAN)) : found->position_mm;
}

double span_mm(const std::string& a, const std::string& b) {
  return (at(skin_landmarks(), a) - at(skin_landmarks(), b)).norm();
}

TEST(CanonicalSkin, IsOneClosedOrientedManifold) {
  const TriangleMesh mesh = canonical_skin(3.0, 1);
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(mesh.normals.rows(), mesh.vertices.rows());
  // Head and neck of an adult.
  EXPECT_GT(enclosed_volume(mesh), 3.5e6);
  EXPECT_LT(enclosed_volume(mesh), 6.5e6);
}

TEST(CanonicalSkin, IsTheSameForAnyNumberOfThreads) {
  const TriangleMesh one = canonical_skin(6.0, 1);
  const TriangleMesh three = canonical_skin(6.0, 3);
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.triangles, three.triangles);
}

TEST(CanonicalSkin, IsSymmetric) {
  const auto skin = skin_solid();
  Random random(1);
  for (int i = 0; i < 200; ++i) {
    const Vector3d p(random.uniform(-95, 95), random.uniform(-130, 120), random.uniform(-120, 130));
    EXPECT_EQ(skin->distance_mm(p), skin->distance_mm({-p.x(), p.y(), p.z()}));
  }
}

TEST(CanonicalSkin, HoldsTheWholeSkull) {
  const auto skin = skin_solid();
  const TriangleMesh skull = canonical_skull(3.0, 1);
  double closest_mm = 1e9;
  for (Eigen::Index v = 0; v < skull.vertices.rows(); ++v) {
    closest_mm = std::min(closest_mm, -skin->distance_mm(skull.vertices.row(v).transpose()));
  }
  EXPECT_GT(closest_mm, 1.5);
}

TEST(SkinLandmarks, AreNamedOnceOnTheSkinAndSymmetric) {
  const auto skin = skin_solid();
  std::set<std::string> names;
  for (const Landmark& landmark : skin_landmarks()) {
    names.insert(landmark.name);
    EXPECT_NEAR(skin->distance_mm(landmark.position_mm), 0.0, 1e-3) << landmark.name;
    if (landmark.name.ends_with(" left")) {
      const Vector3d left = landmark.position_mm;
      const std::string stem = landmark.name.substr(0, landmark.name.size() - 5);
      const Vector3d right = at(skin_landmarks(), stem + " right");
      EXPECT_GT(left.x(), 0.0) << landmark.name;
      EXPECT_EQ(right, Vector3d(-left.x(), left.y(), left.z())) << landmark.name;
    } else if (!landmark.name.ends_with(" right")) {
      EXPECT_NEAR(landmark.position_mm.x(), 0.0, 1e-6) << landmark.name;
    }
  }
  EXPECT_EQ(names.size(), skin_landmarks().size());
}

TEST(SkinLandmarks, LieAsDeepAsTheMeansOfTheTissueThicknessTable) {
  const std::vector<Landmark> skull = canonical_landmarks();
  for (const TissueThickness& depth : thickness_table()) {
    const std::string bone(depth.bone);
    const std::string side = depth.bilateral ? " left" : "";
    const double thickness =
        (at(skin_landmarks(), bone + " skin" + side) - at(skull, bone + side)).norm();
    EXPECT_NEAR(thickness, depth.mean_mm, 1.0) << bone;
  }
}

TEST(SkinLandmarks, NoseEyesAndMouthFollowTheRules) {
  const std::vector<Landmark> skull = canonical_landmarks();
  // Rynn et al. 2010: pronasale from nasion, along and across the line nasion-prosthion.
  const Vector3d nasion = at(skull, "nasion");
  const Vector3d down = (at(skull, "prosthion") - nasion).normalized();
  const Vector3d forward(0.0, down.z(), -down.y());
  const double x = (nasion - at(skull, "acanthion")).norm();
  const double y = (at(skull, "rhinion") - at(skull, "subspinale")).norm();
  const Vector3d pronasale = nasion + (0.9 * x - 2.0) * down + (0.83 * y - 3.5) * forward;
  EXPECT_NEAR((at(skin_landmarks(), "pronasale") - pronasale).norm(), 0.0, 3.0);
  // Stephan 2009: the cornea 16 mm before the lateral orbital margin; 1.5 mm of lid lie on it.
  const double cornea_y = at(skull, "ectoconchion left").y() - 16.0;
  const auto skin = skin_solid();
  EXPECT_GT(skin->distance_mm({31.5, cornea_y - 4.0, 20.0}), 0.0);
  EXPECT_LT(skin->distance_mm({31.5, cornea_y - 0.5, 20.0}), 0.0);
  EXPECT_NEAR(span_mm("cheilion left", "cheilion right"), 53.0, 3.0);
  EXPECT_NEAR(span_mm("endocanthion left", "exocanthion left"), 28.0, 3.0);
  EXPECT_NEAR(span_mm("superaurale left", "subaurale left"), 62.0, 6.0);
}

}  // namespace
}  // namespace skullstation
