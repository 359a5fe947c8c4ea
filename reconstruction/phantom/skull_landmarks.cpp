#include "reconstruction/phantom/skull_landmarks.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace skullstation {

namespace {

using Eigen::Vector3d;

enum class Bone { cranium, mandible };

/// Where to look: the surface point nearest to the seed or, with a direction, the one farthest in
/// that direction within the ball about the seed.
struct Rule {
  std::string_view name;
  Bone bone;
  bool bilateral;
  double seed_mm[3];  ///< on the left side
  double direction[3];
  double radius_mm;
};

constexpr Rule kRules[] = {
    {"glabella", Bone::cranium, false, {0, -83, 42}, {0, -1, 0}, 7},
    {"nasion", Bone::cranium, false, {0, -84, 31.5}, {0, 0, 0}, 0},
    {"rhinion", Bone::cranium, false, {0, -99, 14}, {0, -1, 0}, 6},
    {"acanthion", Bone::cranium, false, {0, -93, -17}, {0, -1, 0}, 5},
    {"subspinale", Bone::cranium, false, {0, -91, -22}, {0, 0, 0}, 0},
    {"prosthion", Bone::cranium, false, {0, -96, -27}, {0, 0, 0}, 0},
    {"bregma", Bone::cranium, false, {0, -10, 117}, {0, 0, 0}, 0},
    {"vertex", Bone::cranium, false, {0, 10, 118}, {0, 0, 1}, 45},
    {"lambda", Bone::cranium, false, {0, 99, 57}, {0, 0, 0}, 0},
    {"opisthocranion", Bone::cranium, false, {0, 100, 45}, {0, 1, 0}, 35},
    {"inion", Bone::cranium, false, {0, 88, 5}, {0, 0.8, -0.6}, 14},
    {"opisthion", Bone::cranium, false, {0, 38, -29}, {0, -1, 0}, 7},
    {"basion", Bone::cranium, false, {0, -3, -20}, {0, 0.4, -1}, 6},
    {"porion", Bone::cranium, true, {58, 0, 0}, {0, 0, 0}, 0},
    {"orbitale", Bone::cranium, true, {33, -75, 0}, {0, 0, 0}, 0},
    {"supraorbitale", Bone::cranium, true, {27, -80, 40}, {0, 0, 0}, 0},
    {"ectoconchion", Bone::cranium, true, {48, -62, 18}, {0, 0, 0}, 0},
    {"dacryon", Bone::cranium, true, {11, -76, 26}, {0, 0, 0}, 0},
    {"frontomalare temporale", Bone::cranium, true, {50, -61, 30}, {1, 0, 0}, 5},
    {"frontotemporale", Bone::cranium, true, {49, -58, 47}, {0, 0, 0}, 0},
    {"euryon", Bone::cranium, true, {70, 20, 40}, {1, 0, 0}, 45},
    {"zygion", Bone::cranium, true, {61, -33, 0}, {1, 0, 0}, 20},
    {"zygomaxillare", Bone::cranium, true, {44, -64, -18}, {0, 0, -1}, 5},
    {"alare", Bone::cranium, true, {12, -79, -8}, {0, 0, 0}, 0},
    {"mastoidale", Bone::cranium, true, {52, 6, -28}, {0, 0, -1}, 10},
    {"infradentale", Bone::mandible, false, {0, -92, -50}, {0, 0, 0}, 0},
    {"supramentale", Bone::mandible, false, {0, -90, -57}, {0, 0, 0}, 0},
    {"pogonion", Bone::mandible, false, {0, -93, -65}, {0, -1, 0}, 5},
    {"gnathion", Bone::mandible, false, {0, -91, -70}, {0, -0.7, -0.7}, 6},
    {"menton", Bone::mandible, false, {0, -85, -72}, {0, 0, -1}, 10},
    {"gonion", Bone::mandible, true, {40, -24, -50}, {0.3, 0.65, -0.7}, 14},
    {"condylion laterale", Bone::mandible, true, {54, -12, -5}, {1, 0, 0}, 8},
    {"coronion", Bone::mandible, true, {46, -49, -10}, {0, 0, 1}, 10},
};

/// A surface point near `start` by Newton's method; where it fails to settle, the best seen.
Vector3d onto_surface(const ImplicitSolid& solid, const Vector3d& start) {
  Vector3d best = start;
  double best_distance = std::abs(solid.distance_mm(start));
  Vector3d point = start;
  for (int step = 0; step < 60 && best_distance > 1e-6; ++step) {
    Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d offset = 0.01 * Vector3d::Unit(axis);
      gradient[axis] =
          (solid.distance_mm(point + offset) - solid.distance_mm(point - offset)) / 0.02;
    }
    const Vector3d newton =
        -solid.distance_mm(point) / std::max(gradient.squaredNorm(), 0.1) * gradient;
    point += newton * std::min(1.0, 2.0 / std::max(newton.norm(), 1e-12));
    const double distance = std::abs(solid.distance_mm(point));
    if (distance < best_distance) {
      best_distance = distance;
      best = point;
    }
  }
  return best;
}

/// The surface point farthest along `direction` in the ball; on the midsagittal plane if `median`.
Vector3d extreme(const ImplicitSolid& solid, const Vector3d& seed, const Vector3d& direction,
                 double radius_mm, bool median) {
  const Vector3d along = direction.normalized();
  const auto allowed = [&](const Vector3d& p) {
    return (p - seed).norm() <= radius_mm && std::abs(solid.distance_mm(p)) < 1e-3;
  };
  constexpr int kSteps = 4;
  Vector3d best = onto_surface(solid, seed);
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      for (int k = -kSteps; k <= kSteps; ++k) {
        if (median && i != 0) continue;
        const Vector3d p = onto_surface(solid, seed + radius_mm / kSteps * Vector3d(i, j, k));
        if (allowed(p) && along.dot(p) > along.dot(best)) best = p;
      }
    }
  }
  for (double step_mm = 0.25 * radius_mm; step_mm > 0.005;) {
    const Vector3d normal = surface_normal(solid, best);
    const Vector3d tangent = along - normal * normal.dot(along);
    if (tangent.norm() < 1e-6) break;
    const Vector3d p = onto_surface(solid, best + step_mm * tangent.normalized());
    if (allowed(p) && along.dot(p) > along.dot(best) + 1e-9) {
      best = p;
    } else {
      step_mm *= 0.5;
    }
  }
  return best;
}

Vector3d find(const ImplicitSolid& whole, const Rule& rule, double side) {
  const Vector3d mirror(side, 1.0, 1.0);
  const Vector3d seed = mirror.cwiseProduct(Vector3d(rule.seed_mm));
  const Vector3d direction = mirror.cwiseProduct(Vector3d(rule.direction));
  // The search strays a little beyond the ball while it settles on the surface.
  const auto solid = whole.near_ball(seed, rule.radius_mm + 8.0, 4.0);
  if (direction.norm() == 0.0) return onto_surface(*solid, seed);
  return extreme(*solid, seed, direction, rule.radius_mm, !rule.bilateral);
}

}  // namespace

std::vector<Landmark> canonical_landmarks(const SkullShape& shape) {
  // The mandible's are found with the jaw closed, where the seeds lie, and move with it.
  SkullShape closed = shape;
  closed.mandible_opening_deg = 0.0;
  const SkullSolids skull = skull_solids(closed);
  const Rigid3 opening = mandible_opening(shape.mandible_opening_deg);
  std::vector<Landmark> landmarks;
  for (const Rule& rule : kRules) {
    const bool on_mandible = rule.bone == Bone::mandible;
    const ImplicitSolid& solid = on_mandible ? *skull.mandible : *skull.cranium;
    const auto add = [&](double side, std::string_view suffix) {
      const Vector3d found = find(solid, rule, side);
      landmarks.push_back(
          {std::string(rule.name).append(suffix), on_mandible ? opening * found : found});
    };
    if (rule.bilateral) {
      add(1.0, " left");
      add(-1.0, " right");
    } else {
      add(1.0, "");
    }
  }
  return landmarks;
}

}  // namespace skullstation
