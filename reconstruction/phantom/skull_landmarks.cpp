#include "reconstruction/phantom/skull_landmarks.h"

#include <algorithm>
#include <cmath>
#include <string_view>

namespace skullstation {

namespace {

using Eigen::Vector3d;

enum class Bone { cranium, mandible };

/// How a landmark is found from its seed.
enum class Search {
  nearest,  ///< the surface point nearest to the seed
  extreme,  ///< the surface point farthest in the rule's direction within the ball about the seed
  roof,     ///< from the seed, which lies in the open, straight up to the bone
  crest,    ///< of the ridge's points farthest in the direction, one for each x, the lowest
};

struct Rule {
  std::string_view name;
  Bone bone;
  bool bilateral;
  Search search;
  double seed_mm[3];  ///< on the left side
  double direction[3];
  double radius_mm;
};

constexpr Search kNearest = Search::nearest;
constexpr Search kExtreme = Search::extreme;

constexpr Rule kRules[] = {
    // The median plane from the front over the vault to the base.
    {"glabella", Bone::cranium, false, kExtreme, {0, -83, 42}, {0, -1, 0}, 7},
    {"nasion", Bone::cranium, false, kNearest, {0, -84, 32}, {}, 0},
    {"midnasale", Bone::cranium, false, kNearest, {0, -92, 23}, {}, 0},
    {"rhinion", Bone::cranium, false, kExtreme, {0, -99, 14}, {0, -1, 0}, 6},
    {"nasospinale", Bone::cranium, false, kNearest, {0, -88, -16}, {}, 0},
    {"acanthion", Bone::cranium, false, kExtreme, {0, -93, -17}, {0, -1, 0}, 5},
    {"subspinale", Bone::cranium, false, kNearest, {0, -91, -22}, {}, 0},
    {"mid-philtrum", Bone::cranium, false, kNearest, {0, -93.5, -24.5}, {}, 0},
    {"prosthion", Bone::cranium, false, kNearest, {0, -96, -27}, {}, 0},
    {"frontal apex", Bone::cranium, false, kNearest, {0, -70, 87.5}, {}, 0},
    {"bregma", Bone::cranium, false, kNearest, {0, -10, 117}, {}, 0},
    {"vertex", Bone::cranium, false, kExtreme, {0, 10, 118}, {0, 0, 1}, 45},
    {"parietal apex", Bone::cranium, false, kNearest, {0, 57, 108}, {}, 0},
    {"lambda", Bone::cranium, false, kNearest, {0, 99, 57}, {}, 0},
    {"opisthocranion", Bone::cranium, false, kExtreme, {0, 100, 45}, {0, 1, 0}, 35},
    {"occipital apex", Bone::cranium, false, kNearest, {0, 92.5, -1}, {}, 0},
    {"inion", Bone::cranium, false, kExtreme, {0, 88, 5}, {0, 0.8, -0.6}, 14},
    {"opisthion", Bone::cranium, false, kExtreme, {0, 38, -29}, {0, -1, 0}, 7},
    {"basion", Bone::cranium, false, kExtreme, {0, -3, -20}, {0, 0.4, -1}, 6},
    // The face and the sides of the cranium.
    {"porion", Bone::cranium, true, Search::roof, {51.57, 0, -6}, {}, 8},
    {"orbitale", Bone::cranium, true, Search::crest, {33, -73.5, -1}, {0, -0.6, 0.8}, 5},
    {"supraorbitale", Bone::cranium, true, kNearest, {27, -80, 40}, {}, 0},
    {"mid-supraorbitale", Bone::cranium, true, kNearest, {31, -79, 40}, {}, 0},
    {"mid-infraorbitale", Bone::cranium, true, kNearest, {30, -78, -2}, {}, 0},
    {"ectoconchion", Bone::cranium, true, kNearest, {48, -62, 18}, {}, 0},
    {"dacryon", Bone::cranium, true, kNearest, {11, -76, 26}, {}, 0},
    {"nasal root", Bone::cranium, true, kNearest, {4.2, -87, 25}, {}, 0},
    {"frontomalare anterior", Bone::cranium, true, kNearest, {49.2, -64.5, 34}, {}, 0},
    {"frontomalare temporale", Bone::cranium, true, kExtreme, {50, -61, 33}, {1, 0, 0}, 5},
    {"frontotemporale", Bone::cranium, true, kNearest, {49, -58, 47}, {}, 0},
    {"coronale", Bone::cranium, true, kNearest, {60, -29, 65}, {}, 0},
    {"stephanion", Bone::cranium, true, kNearest, {57, -26, 75}, {}, 0},
    {"euryon", Bone::cranium, true, kExtreme, {70, 20, 40}, {1, 0, 0}, 45},
    {"asterion", Bone::cranium, true, kNearest, {59, 45.5, 2}, {}, 0},
    {"auriculare", Bone::cranium, true, kNearest, {61, -3, 7}, {}, 0},
    {"zygion", Bone::cranium, true, kExtreme, {61, -33, 0}, {1, 0, 0}, 20},
    {"jugale", Bone::cranium, true, kNearest, {54, -52, 5}, {}, 0},
    {"zygoorbitale", Bone::cranium, true, kNearest, {30.5, -76, -1}, {}, 0},
    {"zygomaxillare", Bone::cranium, true, kExtreme, {44, -64, -18}, {0, 0, -1}, 5},
    {"alare", Bone::cranium, true, kNearest, {12, -79, -8}, {}, 0},
    {"alar curvature point", Bone::cranium, true, kNearest, {17, -82, -12}, {}, 0},
    {"mastoidale", Bone::cranium, true, kExtreme, {52, 6, -28}, {0, 0, -1}, 10},
    {"supra-canine", Bone::cranium, true, kNearest, {18, -89, -25}, {}, 0},
    {"supra-M2", Bone::cranium, true, kNearest, {31, -59, -28}, {}, 0},
    // The mandible.
    {"infradentale", Bone::mandible, false, kNearest, {0, -92, -50}, {}, 0},
    {"supramentale", Bone::mandible, false, kNearest, {0, -90, -57}, {}, 0},
    {"pogonion", Bone::mandible, false, kExtreme, {0, -93, -65}, {0, -1, 0}, 5},
    {"gnathion", Bone::mandible, false, kExtreme, {0, -91, -70}, {0, -0.7, -0.7}, 6},
    {"menton", Bone::mandible, false, kExtreme, {0, -85, -72}, {0, 0, -1}, 10},
    {"infra-canine", Bone::mandible, true, kNearest, {12, -91, -53}, {}, 0},
    {"infra-M2", Bone::mandible, true, kNearest, {33, -57, -50}, {}, 0},
    {"lateral infradentale", Bone::mandible, true, kNearest, {22, -78, -50}, {}, 0},
    {"lateral mandibular border", Bone::mandible, true, kExtreme, {20, -77, -70}, {0, 0, -1}, 5},
    {"mid-mandibular border", Bone::mandible, true, kExtreme, {27, -67, -66}, {0.5, 0, -1}, 5},
    {"gonion", Bone::mandible, true, kExtreme, {40, -24, -50}, {0.3, 0.65, -0.7}, 14},
    {"mid-ramus", Bone::mandible, true, kNearest, {48, -38, -30}, {}, 0},
    {"condylion laterale", Bone::mandible, true, kExtreme, {54, -12, -5}, {1, 0, 0}, 8},
    {"condylion superius", Bone::mandible, true, kExtreme, {46, -14, -1}, {0, 0, 1}, 7},
    {"coronion", Bone::mandible, true, kExtreme, {46, -49, -10}, {0, 0, 1}, 10},
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
  const double spacing_mm = radius_mm / kSteps;
  Vector3d best = onto_surface(solid, seed);
  double best_height = allowed(best) ? along.dot(best) : -1e9;
  for (int i = -kSteps; i <= kSteps; ++i) {
    for (int j = -kSteps; j <= kSteps; ++j) {
      for (int k = -kSteps; k <= kSteps; ++k) {
        if (median && i != 0) continue;
        const Vector3d start = seed + spacing_mm * Vector3d(i, j, k);
        if (std::abs(solid.distance_mm(start)) > 1.2 * spacing_mm) continue;
        const Vector3d p = onto_surface(solid, start);
        if (allowed(p) && along.dot(p) > best_height) {
          best = p;
          best_height = along.dot(p);
        }
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

/// Straight up from `start`, which lies in the open, to the bone.
Vector3d roof_above(const ImplicitSolid& solid, const Vector3d& start, double reach_mm) {
  constexpr double kStep_mm = 0.05;
  double open_mm = 0.0;
  while (open_mm < reach_mm && solid.distance_mm(start + open_mm * Vector3d::UnitZ()) > 0.0) {
    open_mm += kStep_mm;
  }
  double below_mm = open_mm - kStep_mm;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle_mm = 0.5 * (below_mm + open_mm);
    const bool open = solid.distance_mm(start + middle_mm * Vector3d::UnitZ()) > 0.0;
    (open ? below_mm : open_mm) = middle_mm;
  }
  return start + open_mm * Vector3d::UnitZ();
}

/// In the plane of the seed's x the surface point farthest along `direction` (with no x) that can
/// be reached from the seed uphill.
Vector3d crest_at(const ImplicitSolid& solid, const Vector3d& seed, const Vector3d& direction,
                  double radius_mm) {
  const Vector3d along = direction.normalized();
  const Vector3d across = Vector3d::UnitX().cross(along);
  Vector3d best = seed;
  double best_height = -radius_mm;
  constexpr int kSteps = 40;
  for (int i = -kSteps; i <= kSteps; ++i) {
    const Vector3d foot = seed + radius_mm * i / kSteps * across;
    double height = radius_mm;
    while (height > best_height && solid.distance_mm(foot + height * along) > 0.0) height -= 0.02;
    if (height > best_height) {
      best_height = height;
      best = foot + height * along;
    }
  }
  return best;
}

Vector3d lowest_of_crest(const ImplicitSolid& solid, const Vector3d& seed,
                         const Vector3d& direction, double radius_mm) {
  Vector3d lowest = crest_at(solid, seed, direction, radius_mm);
  for (double offset_mm = -radius_mm; offset_mm <= radius_mm; offset_mm += 0.5) {
    const Vector3d foot = seed + offset_mm * Vector3d::UnitX();
    const Vector3d crest = crest_at(solid, foot, direction, radius_mm);
    if (crest.z() < lowest.z()) lowest = crest;
  }
  return onto_surface(solid, lowest);
}

/// On the left side or in the median plane.
Vector3d find(const ImplicitSolid& whole, const Rule& rule) {
  const Vector3d seed(rule.seed_mm);
  const Vector3d direction(rule.direction);
  // The search strays a little beyond the ball while it settles on the surface.
  const auto solid = whole.near_ball(seed, rule.radius_mm + 8.0, 4.0);
  switch (rule.search) {
    case Search::nearest: return onto_surface(*solid, seed);
    case Search::extreme: return extreme(*solid, seed, direction, rule.radius_mm, !rule.bilateral);
    case Search::roof: return roof_above(*solid, seed, rule.radius_mm);
    case Search::crest: return lowest_of_crest(*solid, seed, direction, rule.radius_mm);
  }
  return seed;
}

}  // namespace

std::vector<Landmark> canonical_landmarks(const SkullShape& shape) {
  // The mandible's are found with the jaw closed, where the seeds lie, and move with it. Those of
  // the right side are the left's mirror images, for no landmark lies on a tooth.
  SkullShape closed = shape;
  closed.mandible_opening_deg = 0.0;
  const SkullSolids skull = skull_solids(closed);
  const Rigid3 opening = mandible_opening(shape.mandible_opening_deg);
  std::vector<Landmark> landmarks;
  for (const Rule& rule : kRules) {
    const bool on_mandible = rule.bone == Bone::mandible;
    const ImplicitSolid& solid = on_mandible ? *skull.mandible : *skull.cranium;
    const Vector3d left = find(solid, rule);
    const auto add = [&](double side, std::string_view suffix) {
      const Vector3d point(side * left.x(), left.y(), left.z());
      landmarks.push_back({std::string(rule.name).append(suffix),
                           on_mandible ? opening * point : point, on_mandible});
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
