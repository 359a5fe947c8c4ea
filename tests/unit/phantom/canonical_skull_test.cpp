#include "reconstruction/phantom/canonical_skull.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <vector>

#include "core/random.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/isosurface.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

/// One mesh for all tests; they run in one process only when started together.
const SkullMeshes& coarse_meshes() {
  static const SkullMeshes meshes = skull_meshes(skull_solids(), 2.0, 2);
  return meshes;
}

TEST(CanonicalSkull, BothBonesAreClosedOrientedManifolds) {
  for (const TriangleMesh* mesh : {&coarse_meshes().cranium, &coarse_meshes().mandible}) {
    EXPECT_TRUE(topology_of(*mesh).is_closed_manifold());
    EXPECT_GT(enclosed_volume(*mesh), 0.0);
  }
}

TEST(CanonicalSkull, EachBoneIsInOnePiece) {
  EXPECT_EQ(topology_of(coarse_meshes().cranium).components, 1);
  EXPECT_EQ(topology_of(coarse_meshes().mandible).components, 1);
}

TEST(CanonicalSkull, HasTheSizeOfAnAdultMale) {
  const Eigen::AlignedBox3d cranium = bounding_box(coarse_meshes().cranium);
  // Howells 1973 and 1989: GOL 183 +- 8, XCB 139 +- 7 mm; a broad, long-faced skull here.
  EXPECT_NEAR(cranium.sizes().x(), 143.0, 4.0);
  EXPECT_NEAR(cranium.sizes().y(), 200.0, 6.0);
}

TEST(CanonicalSkull, IsSymmetric) {
  const SkullSolids skull = skull_solids();
  Random random(1);
  for (int i = 0; i < 2000; ++i) {
    const Vector3d p(random.uniform(0, 80), random.uniform(-105, 105), random.uniform(-75, 125));
    const Vector3d q(-p.x(), p.y(), p.z());
    ASSERT_EQ(skull.cranium->distance_mm(p), skull.cranium->distance_mm(q));
    ASSERT_EQ(skull.mandible->distance_mm(p), skull.mandible->distance_mm(q));
  }
}

TEST(CanonicalSkull, MandibleAndCraniumNeverTouch) {
  const SkullSolids skull = skull_solids();
  const TriangleMesh& mandible = coarse_meshes().mandible;
  for (Eigen::Index v = 0; v < mandible.vertices.rows(); ++v) {
    ASSERT_GT(skull.cranium->distance_mm(mandible.vertices.row(v)), 0.2);
  }
}

TEST(CanonicalSkull, IsTheSameForAnyNumberOfThreads) {
  const SkullMeshes one = skull_meshes(skull_solids(), 3.0, 1);
  const SkullMeshes two = skull_meshes(skull_solids(), 3.0, 2);
  EXPECT_EQ(one.cranium.vertices, two.cranium.vertices);
  EXPECT_EQ(one.cranium.triangles, two.cranium.triangles);
  EXPECT_EQ(one.mandible.vertices, two.mandible.vertices);
  EXPECT_EQ(one.mandible.triangles, two.mandible.triangles);
}

TEST(CanonicalSkull, TheQuickSolidAgreesNearTheSurface) {
  const SkullSolids skull = skull_solids();
  Random random(4);
  for (int i = 0; i < 400; ++i) {
    const Vector3d center(random.uniform(-75, 75), random.uniform(-100, 100),
                          random.uniform(-70, 120));
    const auto near = skull.cranium->near_ball(center, 8.0, 2.0);
    for (int k = 0; k < 20; ++k) {
      const Vector3d offset(random.uniform(-4, 4), random.uniform(-4, 4), random.uniform(-4, 4));
      const double whole = skull.cranium->distance_mm(center + offset);
      const double quick = near->distance_mm(center + offset);
      if (std::abs(whole) < 2.0) {
        ASSERT_NEAR(quick, whole, 0.01);
      } else {
        ASSERT_EQ(quick < 0.0, whole < 0.0);
      }
    }
  }
}

TEST(CanonicalSkull, DistancesGrowAtAboutUnitRateNearTheSurface) {
  const SkullSolids skull = skull_solids();
  const TriangleMesh& mesh = coarse_meshes().cranium;
  Random random(5);
  std::vector<double> slopes;
  for (int i = 0; i < 4000; ++i) {
    const auto v = static_cast<Eigen::Index>(random.below(mesh.vertices.rows()));
    const Vector3d p =
        Vector3d(mesh.vertices.row(v)) + random.uniform(-1.0, 1.0) * Vector3d(mesh.normals.row(v));
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = 0.01 * Vector3d::Unit(axis);
      gradient[axis] =
          (skull.cranium->distance_mm(p + step) - skull.cranium->distance_mm(p - step)) / 0.02;
    }
    slopes.push_back(gradient.norm());
  }
  std::ranges::sort(slopes);
  EXPECT_GT(slopes[slopes.size() / 2], 0.75);
  EXPECT_GT(slopes[slopes.size() / 20], 0.35);
  EXPECT_LT(slopes[slopes.size() * 99 / 100], 1.5);
}

TEST(CanonicalSkull, AMissingToothIsGoneOnItsSideOnly) {
  SkullShape shape;
  shape.missing_teeth = {26};
  const SkullSolids whole = skull_solids();
  const SkullSolids gap = skull_solids(shape);
  int lost_left = 0;
  int lost_right = 0;
  for (double x = -60; x <= 60; x += 1.0) {
    for (double y = -90; y <= -20; y += 1.0) {
      for (double z = -60; z <= -15; z += 1.0) {
        const Vector3d p(x, y, z);
        if (whole.cranium->distance_mm(p) < 0.0 && gap.cranium->distance_mm(p) > 0.0) {
          ++(x > 0.0 ? lost_left : lost_right);
        }
      }
    }
  }
  EXPECT_GT(lost_left, 100);
  EXPECT_EQ(lost_right, 0);
}

TEST(CanonicalSkull, OpeningTheJawLowersTheChin) {
  SkullShape shape;
  shape.mandible_opening_deg = 20.0;
  const TriangleMesh open =
      isosurface(*skull_solids(shape).mandible, {.cell_mm = 2.0, .threads = 2});
  EXPECT_TRUE(topology_of(open).is_closed_manifold());
  const double closed_chin = bounding_box(coarse_meshes().mandible).min().z();
  EXPECT_LT(bounding_box(open).min().z(), closed_chin - 15.0);
}

TEST(CanonicalSkull, AThickerVaultGrowsInwards) {
  SkullShape shape;
  shape.extra_vault_thickness_mm = 2.0;
  const SkullSolids thick = skull_solids(shape);
  const SkullSolids usual = skull_solids();
  // Down the midline from the vertex: first hit and end of the bone.
  const auto thickness = [](const SkullSolids& skull) {
    double bone = 0.0;
    for (double z = 130.0; z > 80.0; z -= 0.1) {
      if (skull.cranium->distance_mm({0.0, 10.0, z}) < 0.0) bone += 0.1;
    }
    return bone;
  };
  EXPECT_NEAR(thickness(thick) - thickness(usual), 2.0, 0.4);
}

TEST(CanonicalSkull, OneMeshHoldsBothBones) {
  const TriangleMesh mesh = canonical_skull(3.0, 2);
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.components, 2);
  EXPECT_EQ(mesh.normals.rows(), mesh.vertices.rows());
}

}  // namespace
}  // namespace skullstation
