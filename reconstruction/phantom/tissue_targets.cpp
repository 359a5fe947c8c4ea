#include "reconstruction/phantom/tissue_targets.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <string>
#include <string_view>
#include <utility>

#include "reconstruction/anatomy/feature_rules.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

using Eigen::Vector3d;

std::vector<WarpTarget> tissue_targets(std::span<const Landmark> bone,
                                       std::span<const Landmark> skin) {
  std::vector<Vector3d> places;
  for (const Landmark& landmark : bone) places.push_back(landmark.position_mm);
  for (const Landmark& landmark : skin) places.push_back(landmark.position_mm);
  const auto index = [](std::span<const Landmark> among, std::string_view name) {
    const auto found = std::ranges::find(among, name, &Landmark::name);
    assert(found != among.end());
    return static_cast<int>(found - among.begin());
  };
  const auto on_bone = [&](std::string_view name) { return index(bone, name); };
  const auto on_skin = [&](std::string_view name) {
    return static_cast<int>(bone.size()) + index(skin, name);
  };
  std::vector<WarpTarget> targets;
  const auto keep = [&](ShapeMeasure measure, double tolerance_mm) {
    const double own = measured(measure, places);
    targets.push_back({std::move(measure), own, tolerance_mm});
  };
  for (const TissueThickness& row : thickness_table()) {
    for (const char* side : {" left", " right"}) {
      const std::string suffix = row.bilateral ? side : "";
      const std::string name(row.bone);
      keep(length_measure(name, on_bone(name + suffix),
                          on_skin(fmt::format("{} skin{}", name, suffix))),
           0.3 + 0.04 * row.mean_mm);
      if (!row.bilateral) break;
    }
  }
  for (const std::string side : {" left", " right"}) {
    keep(length_measure("ear", on_skin("superaurale" + side), on_skin("subaurale" + side)), 1.5);
  }
  targets.push_back({{"nasal wings",
                      {on_skin("alare left"), on_skin("alare right"), on_bone("alare left"),
                       on_bone("alare right")},
                      [](std::span<const Vector3d> points) {
                        return (points[0] - points[1]).norm() - (points[2] - points[3]).norm();
                      }},
                     kAlarWings_mm,
                     0.7});
  targets.push_back({{"mouth",
                      {on_skin("cheilion left"), on_skin("cheilion right"),
                       on_bone("supra-canine left"), on_bone("supra-canine right")},
                      [](std::span<const Vector3d> points) {
                        return (points[0] - points[1]).norm() -
                               (points[2] - points[3]).norm() / kCaninesToMouth;
                      }},
                     0.0,
                     1.0});
  for (const int axis : {1, 2}) {
    targets.push_back({{"tip of the nose",
                        {on_bone("nasion"), on_bone("acanthion"), on_bone("rhinion"),
                         on_bone("subspinale"), on_bone("prosthion"), on_bone("porion left"),
                         on_bone("porion right"), on_skin("pronasale")},
                        [axis](std::span<const Vector3d> points) {
                          const NoseBones bones{points[0], points[1], points[2], points[3],
                                                points[4], points[5], points[6]};
                          return points[7][axis] - expected_pronasale(bones)[axis];
                        }},
                       0.0,
                       1.0});
  }
  return targets;
}

}  // namespace skullstation
