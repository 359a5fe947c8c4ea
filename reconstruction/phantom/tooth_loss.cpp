#include "reconstruction/phantom/tooth_loss.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

using Eigen::Vector3d;

namespace {

/// A ball about both rows of teeth with their roots.
const Vector3d kTeeth_mm(0.0, -68.0, -40.0);
constexpr double kTeethRadius_mm = 48.0;
/// How far the search for the ridge strays from the teeth.
constexpr double kStray_mm = 4.0;
/// Vertices nearer than this to the surface are on it: meshing is no more exact.
constexpr double kOnSurface_mm = 0.1;

/// A surface point below `start` by Newton's method; where it fails to settle, the best seen.
Vector3d onto_ridge(const ImplicitSolid& bone, const Vector3d& start) {
  Vector3d point = start;
  Vector3d best = start;
  double distance_mm = bone.distance_mm(point);
  double best_mm = std::abs(distance_mm);
  for (int step = 0; step < 40 && best_mm > 0.005; ++step) {
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d offset = 0.01 * Vector3d::Unit(axis);
      gradient[axis] = (bone.distance_mm(point + offset) - bone.distance_mm(point - offset)) / 0.02;
    }
    const Vector3d newton = -distance_mm / std::max(gradient.squaredNorm(), 0.1) * gradient;
    point += newton * std::min(1.0, 1.0 / std::max(newton.norm(), 1e-12));
    distance_mm = bone.distance_mm(point);
    if (std::abs(distance_mm) < best_mm) {
      best_mm = std::abs(distance_mm);
      best = point;
    }
  }
  return best;
}

}  // namespace

std::vector<int> draw_missing_teeth(double age_years, std::uint64_t seed) {
  constexpr double kByPosition[] = {-0.4, -0.3, -0.9, 0.0, 0.1, 0.7, 0.6};  // incisor .. molar
  Random random(seed);
  const double own = random.normal(0.0, 1.2);
  std::vector<int> missing;
  for (int quadrant = 1; quadrant <= 4; ++quadrant) {
    for (int position = 1; position <= 7; ++position) {
      const double log_odds = -4.62 + 0.052 * age_years + own + kByPosition[position - 1];
      if (random.uniform() < 1.0 / (1.0 + std::exp(-log_odds))) {
        missing.push_back(10 * quadrant + position);
      }
    }
  }
  return missing;
}

TriangleMesh with_healed_sockets(TriangleMesh skull, Eigen::Index cranium_vertices,
                                 const std::vector<int>& missing_teeth, int threads) {
  SkullShape shape;
  shape.missing_teeth = missing_teeth;
  const SkullSolids whole = skull_solids(shape);
  const auto cranium = whole.cranium->near_ball(kTeeth_mm, kTeethRadius_mm + kStray_mm, 12.0);
  const auto mandible = whole.mandible->near_ball(kTeeth_mm, kTeethRadius_mm + kStray_mm, 12.0);
  parallel_for(static_cast<int>(skull.vertices.rows()), threads, [&](int v) {
    const Vector3d place = skull.vertices.row(v);
    if ((place - kTeeth_mm).norm() > kTeethRadius_mm) return;
    const ImplicitSolid& bone = v < cranium_vertices ? *cranium : *mandible;
    if (std::abs(bone.distance_mm(place)) < kOnSurface_mm) return;
    skull.vertices.row(v) = onto_ridge(bone, place).transpose();
  });
  skull.normals = vertex_normals(skull);
  return skull;
}

}  // namespace skullstation
