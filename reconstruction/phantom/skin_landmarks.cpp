#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

/// A landmark of the skin alone: the surface point nearest to the seed or, with a direction, the
/// farthest one in that direction uphill from there.
struct Rule {
  std::string_view name;
  bool bilateral;
  double seed_mm[3];  ///< on the left side
  double direction[3];
};

constexpr Rule kRules[] = {
    {"pronasale", false, {0, -119, -7}, {0, -1, 0}},
    {"subnasale", false, {0, -106.2, -20}, {0, 0, 0}},
    {"stomion", false, {0, -106.5, -38.9}, {0, 0, 0}},
    {"alare", true, {18.5, -98, -10}, {1, 0, 0}},
    {"cheilion", true, {26.6, -92, -39.9}, {0, 0, 0}},
    {"endocanthion", true, {18.6, -77.5, 17.6}, {0, 0, 0}},
    {"exocanthion", true, {44.5, -74, 18.6}, {0, 0, 0}},
    {"ciliare medialis", true, {11.5, -86.5, 41.5}, {0, 0, 0}},
    {"ciliare lateralis", true, {52, -68, 38}, {0, 0, 0}},
    {"tragion", true, {69.5, -4.5, 3}, {0, 0, 0}},
    {"superaurale", true, {77, 10, 28.5}, {0, 0, 1}},
    {"subaurale", true, {69, -7, -30}, {0, 0, -1}},
};

Vector3d gradient_at(const ImplicitSolid& solid, const Vector3d& point) {
  Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d step = 0.01 * Vector3d::Unit(axis);
    gradient[axis] = (solid.distance_mm(point + step) - solid.distance_mm(point - step)) / 0.02;
  }
  return gradient;
}

/// A surface point near `start` by Newton's method.
Vector3d onto_surface(const ImplicitSolid& solid, Vector3d point) {
  for (int step = 0; step < 60; ++step) {
    const double distance = solid.distance_mm(point);
    if (std::abs(distance) < 1e-7) break;
    const Vector3d gradient = gradient_at(solid, point);
    const Vector3d newton = -distance / std::max(gradient.squaredNorm(), 0.1) * gradient;
    point += newton * std::min(1.0, 1.0 / std::max(newton.norm(), 1e-12));
  }
  return point;
}

Vector3d uphill(const ImplicitSolid& solid, Vector3d point, const Vector3d& direction) {
  for (double step_mm = 1.0; step_mm > 0.002;) {
    const Vector3d normal = gradient_at(solid, point).normalized();
    const Vector3d tangent = direction - normal * normal.dot(direction);
    if (tangent.norm() < 1e-6) break;
    const Vector3d next = onto_surface(solid, point + step_mm * tangent.normalized());
    if (direction.dot(next - point) > 1e-9) {
      point = next;
    } else {
      step_mm *= 0.5;
    }
  }
  return point;
}

/// Where the ray from the bone leaves the skin. The rays start well inside and end well outside.
Vector3d out_of_skin(const ImplicitSolid& solid, const Vector3d& bone, const Vector3d& direction) {
  constexpr double kStep_mm = 0.25;
  constexpr double kReach_mm = 60.0;
  double outside_mm = kStep_mm;
  while (outside_mm < kReach_mm && solid.distance_mm(bone + outside_mm * direction) < 0.0) {
    outside_mm += kStep_mm;
  }
  double inside_mm = outside_mm - kStep_mm;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle_mm = 0.5 * (inside_mm + outside_mm);
    const bool inside = solid.distance_mm(bone + middle_mm * direction) < 0.0;
    (inside ? inside_mm : outside_mm) = middle_mm;
  }
  return bone + inside_mm * direction;
}

void add(std::vector<Landmark>& landmarks, std::string_view name, bool bilateral,
         const Vector3d& left) {
  if (!bilateral) {
    landmarks.push_back({std::string(name), left});
    return;
  }
  landmarks.push_back({std::string(name) + " left", left});
  landmarks.push_back({std::string(name) + " right", {-left.x(), left.y(), left.z()}});
}

}  // namespace

std::vector<Landmark> canonical_skin_landmarks() {
  const std::unique_ptr<ImplicitSolid> skin = skin_solid();
  const std::vector<Landmark> skull = canonical_landmarks();
  std::vector<Landmark> landmarks;
  for (const TissueThickness& depth : thickness_table()) {
    const std::string bone_name = std::string(depth.bone) + (depth.bilateral ? " left" : "");
    const auto bone = std::ranges::find(skull, bone_name, &Landmark::name);
    const Vector3d direction = Vector3d(depth.direction).normalized();
    const auto near = skin->near_ball(bone->position_mm, 60.0, 10.0);
    add(landmarks, std::string(depth.bone) + " skin", depth.bilateral,
        out_of_skin(*near, bone->position_mm, direction));
  }
  for (const Rule& rule : kRules) {
    const Vector3d seed(rule.seed_mm);
    const Vector3d direction(rule.direction);
    const auto near = skin->near_ball(seed, 25.0, 10.0);
    Vector3d point = onto_surface(*near, seed);
    if (direction.norm() > 0.0) point = uphill(*near, point, direction);
    add(landmarks, rule.name, rule.bilateral, point);
  }
  return landmarks;
}

}  // namespace skullstation
