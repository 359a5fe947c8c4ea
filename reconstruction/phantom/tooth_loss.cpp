#include "reconstruction/phantom/tooth_loss.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/phantom/canonical_skull.h"

namespace skullstation {

using Eigen::Vector3d;

namespace {

/// A ball about both rows of teeth with their roots.
const Vector3d kTeeth_mm(0.0, -68.0, -40.0);
constexpr double kTeethRadius_mm = 48.0;
/// A tooth's surface is nowhere farther from the line through its crown and root.
constexpr double kToothRadius_mm = 12.0;
/// Vertices nearer than this to the healed surface are on it: meshing is no more exact.
constexpr double kOnSurface_mm = 0.1;
/// Rounds of evening out the crown's triangles on the healed bone.
constexpr int kEvenings = 30;

double distance_from_axis_mm(const Tooth& tooth, const Vector3d& point) {
  const Vector3d axis = tooth.crown_mm - tooth.root_mm;
  const double along = std::max(0.0, (point - tooth.root_mm).dot(axis) / axis.squaredNorm());
  return (point - tooth.root_mm - along * axis).norm();
}

/// Where the way from `start` to `inside` first meets the bone; nothing if it begins in it or never
/// meets it.
std::optional<Vector3d> onto_ridge(const ImplicitSolid& bone, const Vector3d& start,
                                   const Vector3d& inside) {
  constexpr double kStep_mm = 0.25;
  const Vector3d way = inside - start;
  const int steps = static_cast<int>(std::ceil(way.norm() / kStep_mm));
  double outer = 0.0;
  double inner = 0.0;
  if (bone.distance_mm(start) <= 0.0) return std::nullopt;
  for (int step = 1; step <= steps; ++step) {
    inner = static_cast<double>(step) / steps;
    if (bone.distance_mm(start + inner * way) <= 0.0) {
      for (int halving = 0; halving < 12; ++halving) {
        const double middle = 0.5 * (outer + inner);
        (bone.distance_mm(start + middle * way) <= 0.0 ? inner : outer) = middle;
      }
      return start + inner * way;
    }
    outer = inner;
  }
  return std::nullopt;
}

/// The surface's point next to one near it; nothing if the search does not settle.
std::optional<Vector3d> onto_surface(const ImplicitSolid& bone, Vector3d point) {
  for (int step = 0; step < 6; ++step) {
    const double distance_mm = bone.distance_mm(point);
    if (std::abs(distance_mm) < 0.01) return point;
    point -= std::clamp(distance_mm, -2.0, 2.0) * surface_normal(bone, point);
  }
  return std::nullopt;
}

/// The vertices that stood on lost teeth, and the middle of the root that each of them had.
struct Crown {
  std::vector<int> vertices;
  std::vector<Vector3d> root_mm;
  std::vector<std::vector<int>> neighbors;
};

Crown lost_crown(const TriangleMesh& skull, Eigen::Index first, Eigen::Index end,
                 const ImplicitSolid& healed, const std::vector<Tooth>& lost, int threads) {
  std::vector<const Tooth*> tooth_of(static_cast<std::size_t>(end - first), nullptr);
  parallel_for(static_cast<int>(end - first), threads, [&](int v) {
    const Vector3d place = skull.vertices.row(first + v);
    const auto nearest = std::ranges::min_element(
        lost, {}, [&](const Tooth& tooth) { return distance_from_axis_mm(tooth, place); });
    if (distance_from_axis_mm(*nearest, place) > kToothRadius_mm) return;
    if (healed.distance_mm(place) > kOnSurface_mm) tooth_of[v] = &*nearest;
  });
  Crown crown;
  std::vector<int> place_of(tooth_of.size(), -1);
  for (std::size_t v = 0; v < tooth_of.size(); ++v) {
    if (tooth_of[v] == nullptr) continue;
    place_of[v] = static_cast<int>(crown.vertices.size());
    crown.vertices.push_back(static_cast<int>(first) + static_cast<int>(v));
    crown.root_mm.push_back(tooth_of[v]->root_mm);
  }
  crown.neighbors.resize(crown.vertices.size());
  for (Eigen::Index t = 0; t < skull.triangles.rows(); ++t) {
    for (int corner = 0; corner < 3; ++corner) {
      const int vertex = skull.triangles(t, corner);
      if (vertex < first || vertex >= end || place_of[vertex - first] < 0) continue;
      crown.neighbors[place_of[vertex - first]].push_back(skull.triangles(t, (corner + 1) % 3));
    }
  }
  return crown;
}

/// The crown's vertices onto the ridge, along lines to where the root was; then, as a membrane
/// would, evened out on the healed bone: a crown is wider than its neck, so it lies in folds, and
/// it hid the neighbours' sides, which want to be covered.
void lower(TriangleMesh& skull, const Crown& crown, const ImplicitSolid& healed, int threads) {
  const auto count = static_cast<int>(crown.vertices.size());
  std::vector<Vector3d> places(crown.vertices.size());
  for (int round = 0; round <= kEvenings; ++round) {
    parallel_for(count, threads, [&](int c) {
      places[c] = skull.vertices.row(crown.vertices[c]);
      std::optional<Vector3d> place;
      if (round == 0) {
        place = onto_ridge(healed, places[c], crown.root_mm[c]);
      } else {
        Vector3d mean = Vector3d::Zero();
        for (const int neighbor : crown.neighbors[c]) mean += skull.vertices.row(neighbor);
        place = onto_surface(healed, mean / static_cast<double>(crown.neighbors[c].size()));
      }
      if (place) places[c] = *place;
    });
    for (int c = 0; c < count; ++c) skull.vertices.row(crown.vertices[c]) = places[c].transpose();
  }
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
  const SkullSolids healed = skull_solids(shape);
  for (const bool upper : {true, false}) {
    std::vector<Tooth> lost = canonical_teeth();
    std::erase_if(lost, [&](const Tooth& tooth) {
      return tooth.upper != upper || std::ranges::count(missing_teeth, tooth.fdi) == 0;
    });
    if (lost.empty()) continue;
    const auto bone = (upper ? healed.cranium : healed.mandible)
                          ->near_ball(kTeeth_mm, kTeethRadius_mm, kToothRadius_mm);
    const Crown crown =
        lost_crown(skull, upper ? 0 : cranium_vertices,
                   upper ? cranium_vertices : skull.vertices.rows(), *bone, lost, threads);
    lower(skull, crown, *bone, threads);
  }
  skull.normals = vertex_normals(skull);
  return skull;
}

}  // namespace skullstation
