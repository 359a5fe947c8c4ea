#include "reconstruction/phantom/isosurface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <utility>

#include "core/random.h"
#include "reconstruction/mesh/mesh_topology.h"

namespace skullstation {
namespace {

using Eigen::Vector3d;

class FormulaSolid final : public ImplicitSolid {
 public:
  FormulaSolid(std::function<double(const Vector3d&)> distance_mm, double reach_mm)
      : distance_mm_(std::move(distance_mm)), reach_mm_(reach_mm) {}
  double distance_mm(const Vector3d& point) const override { return distance_mm_(point); }
  Eigen::AlignedBox3d bounds() const override {
    return {Vector3d::Constant(-reach_mm_), Vector3d::Constant(reach_mm_)};
  }
  std::unique_ptr<ImplicitSolid> near_ball(const Vector3d&, double, double) const override {
    return std::make_unique<FormulaSolid>(distance_mm_, reach_mm_);
  }

 private:
  std::function<double(const Vector3d&)> distance_mm_;
  double reach_mm_;
};

TEST(Isosurface, ASphereHasItsAreaVolumeAndTopology) {
  const FormulaSolid sphere([](const Vector3d& p) { return p.norm() - 20.0; }, 20.0);
  const TriangleMesh mesh = isosurface(sphere, {.cell_mm = 1.0, .threads = 1});
  const MeshTopology topology = topology_of(mesh);
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.components, 1);
  EXPECT_EQ(topology.euler_characteristic, 2);
  EXPECT_NEAR(enclosed_volume(mesh), 4.0 / 3.0 * std::numbers::pi * 8000.0, 40.0);
  EXPECT_NEAR(surface_area(mesh), 4.0 * std::numbers::pi * 400.0, 10.0);
  for (Eigen::Index v = 0; v < mesh.vertices.rows(); ++v) {
    const Vector3d p = mesh.vertices.row(v);
    ASSERT_NEAR(p.norm(), 20.0, 1e-3);
    ASSERT_GT(p.normalized().dot(Vector3d(mesh.normals.row(v))), 0.9999);
  }
}

TEST(Isosurface, ATorusHasOneHandle) {
  const FormulaSolid torus(
      [](const Vector3d& p) { return std::hypot(std::hypot(p.x(), p.y()) - 12.0, p.z()) - 4.0; },
      16.0);
  const MeshTopology topology = topology_of(isosurface(torus, {.cell_mm = 0.8, .threads = 1}));
  EXPECT_TRUE(topology.is_closed_manifold());
  EXPECT_EQ(topology.euler_characteristic, 0);
}

TEST(Isosurface, StaysAManifoldWhereEveryCaseOfTheCubeOccurs) {
  // White noise at the grid points: all 256 cases, ambiguous faces on both sides of one another.
  const auto noise = [](const Vector3d& p) {
    if (p.cwiseAbs().maxCoeff() > 14.5) return 1.0;
    const auto at = [](double x) { return static_cast<std::uint64_t>(std::lround(x) + 100); };
    Random random(mix(mix(at(p.x()), at(p.y())), at(p.z())));
    return random.uniform() - 0.5;
  };
  const FormulaSolid solid(noise, 16.0);
  const TriangleMesh mesh =
      isosurface(solid, {.cell_mm = 1.0, .relaxation_steps = 0, .threads = 1});
  EXPECT_GT(mesh.triangles.rows(), 50000);
  EXPECT_TRUE(topology_of(mesh).is_closed_manifold());
}

TEST(Isosurface, IsTheSameForAnyNumberOfThreads) {
  const FormulaSolid sphere([](const Vector3d& p) { return p.norm() - 11.3; }, 12.0);
  const TriangleMesh one = isosurface(sphere, {.cell_mm = 0.7, .threads = 1});
  const TriangleMesh three = isosurface(sphere, {.cell_mm = 0.7, .threads = 3});
  EXPECT_EQ(one.vertices, three.vertices);
  EXPECT_EQ(one.normals, three.normals);
  EXPECT_EQ(one.triangles, three.triangles);
}

TEST(Isosurface, RelaxationEvensOutTheTriangles) {
  const FormulaSolid sphere([](const Vector3d& p) { return p.norm() - 20.0; }, 20.0);
  const auto mean_quality = [&](int steps) {
    const TriangleMesh mesh =
        isosurface(sphere, {.cell_mm = 1.0, .relaxation_steps = steps, .threads = 1});
    double sum = 0.0;
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      const Vector3d a = mesh.vertices.row(mesh.triangles(f, 0));
      const Vector3d b = mesh.vertices.row(mesh.triangles(f, 1));
      const Vector3d c = mesh.vertices.row(mesh.triangles(f, 2));
      const double area = 0.5 * (b - a).cross(c - a).norm();
      sum += 4.0 * std::sqrt(3.0) * area /
             ((b - a).squaredNorm() + (c - b).squaredNorm() + (a - c).squaredNorm());
    }
    return sum / static_cast<double>(mesh.triangles.rows());
  };
  EXPECT_LT(mean_quality(0), 0.8);
  EXPECT_GT(mean_quality(3), 0.85);
}

}  // namespace
}  // namespace skullstation
