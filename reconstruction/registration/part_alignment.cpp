#include "reconstruction/registration/part_alignment.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "core/parallel.h"
#include "core/units.h"
#include "reconstruction/registration/affine_fit.h"
#include "reconstruction/registration/point_icp.h"
#include "reconstruction/registration/similarity_fit.h"

namespace skullstation {

namespace {

constexpr int kPointsOfPart = 1000;
constexpr Eigen::Index kLeastSamples = 200;  ///< of the input, to look for a mandible in
/// Distances beyond this count as this: what a part's cost is made of.
constexpr double kTruncation_mm = 6.0;
/// Where a bone costs more, it is not there: most of its points find nothing.
constexpr double kFoundCost_mm2 = 0.6 * kTruncation_mm * kTruncation_mm;

/// How far a part may leave its parent.
struct Bounds {
  double max_distance_mm;  ///< of pairs
  double scale;            ///< between 1/scale and scale
  double angle_deg;
  double shift_mm;  ///< of the part's centroid
  double least_overlap;
};

constexpr Bounds kBone{25.0, 1.6, 35.0, 45.0, 0.4};
constexpr Bounds kGroup{8.0, 1.1, 10.0, 8.0, 0.4};
constexpr Bounds kRegion{6.0, 1.1, 10.0, 6.0, 0.5};

using Regions = std::vector<SkullRegion>;
using enum SkullRegion;

const std::vector<Regions>& groups() {
  static const std::vector<Regions> all = {
      {calvaria, occiput},
      {base, temporal_left, temporal_right},
      {zygoma_left, orbit_left},
      {zygoma_right, orbit_right},
      {nose, orbit_left, orbit_right},
      {maxilla, upper_teeth},
      {chin, lower_teeth},
      {mandible_body_left, ramus_left},
      {mandible_body_right, ramus_right},
  };
  return all;
}

OrientedPoints points_of(const SkullTemplate& skull, const TriangleMesh& surface,
                         const Regions& regions) {
  std::vector<int> members;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    if (skull.outer[at] && std::ranges::count(regions, skull.region[at]) > 0) {
      members.push_back(v);
    }
  }
  const std::size_t stride = std::max<std::size_t>(1, members.size() / kPointsOfPart);
  const auto count = static_cast<Eigen::Index>((members.size() + stride - 1) / stride);
  OrientedPoints points;
  points.positions.resize(count, 3);
  points.normals.resize(count, 3);
  for (Eigen::Index i = 0; i < count; ++i) {
    const int v = members[static_cast<std::size_t>(i) * stride];
    points.positions.row(i) = surface.vertices.row(v);
    points.normals.row(i) = surface.normals.row(v);
  }
  return points;
}

/// What a part is laid on.
struct Target {
  const OrientedPoints& points;
  const PointTree& tree;
  /// There is nothing but the part to be found here: what it leaves uncovered counts against it.
  bool all_of_it = false;
};

/// Mean truncated squared distance of the points from the target where the normals agree [mm^2].
double one_way_cost(const OrientedPoints& points, const Target& target) {
  double sum = 0.0;
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    const NearPoint near = target.tree.nearest(points.positions.row(i), kTruncation_mm);
    const bool agrees =
        near.index >= 0 && target.points.normals.row(near.index).dot(points.normals.row(i)) > 0.5;
    sum += agrees ? near.squared_distance : kTruncation_mm * kTruncation_mm;
  }
  return sum / static_cast<double>(std::max<Eigen::Index>(1, points.size()));
}

/// The same for a part that is moved; where all of the target is to be covered, the mean of both
/// ways.
double cost_of(const OrientedPoints& points, const Similarity3& transform, const Target& target) {
  OrientedPoints moved = points;
  for (Eigen::Index i = 0; i < points.size(); ++i) {
    moved.positions.row(i) = (transform * points.positions.row(i).transpose()).transpose();
    moved.normals.row(i) = (transform.rotation * points.normals.row(i).transpose()).transpose();
  }
  const double there = one_way_cost(moved, target);
  if (!target.all_of_it) return there;
  const PointTree tree(moved.positions);
  return 0.5 * (there + one_way_cost(target.points, {moved, tree}));
}

bool within(const Bounds& bounds, const Similarity3& now, const Similarity3& parent,
            const Eigen::Vector3d& centroid) {
  const double scale = now.scale / parent.scale;
  const double angle_deg = degrees(now.rotation.angularDistance(parent.rotation));
  return scale <= bounds.scale && scale >= 1.0 / bounds.scale && angle_deg <= bounds.angle_deg &&
         (now * centroid - parent * centroid).norm() <= bounds.shift_mm;
}

std::optional<Similarity3> align_part(const OrientedPoints& points, const Target& target,
                                      const Similarity3& parent,
                                      const std::vector<Similarity3>& starts,
                                      const Bounds& bounds) {
  if (points.size() < 30) return std::nullopt;
  const Eigen::Vector3d centroid = points.positions.colwise().mean();
  std::optional<Similarity3> best;
  double least = cost_of(points, parent, target);
  for (const Similarity3& start : starts) {
    // With its size free from the beginning, a part that is far off may shrink into what is near;
    // with its size held, one that is far too small may slide along.
    for (const bool free_size : {true, false}) {
      PointIcpOptions options;
      options.estimate_scale = free_size;
      options.max_normal_angle_deg = 50.0;
      options.tolerance_mm = 1e-2;
      options.threads = 1;
      options.max_distance_mm = bounds.max_distance_mm;
      auto fit = align_points(points, target.points, target.tree, start, options);
      if (!fit) continue;
      options.estimate_scale = true;
      options.max_distance_mm = 0.5 * bounds.max_distance_mm;
      fit = align_points(points, target.points, target.tree, fit->target_from_source, options);
      if (!fit || fit->overlap < bounds.least_overlap ||
          !within(bounds, fit->target_from_source, parent, centroid)) {
        continue;
      }
      const double cost = cost_of(points, fit->target_from_source, target);
      if (cost >= least) continue;
      least = cost;
      best = fit->target_from_source;
    }
  }
  return best;
}

/// How the bending of the cranium moves what the mandible hangs on: both joints and the upper
/// teeth, each counting alike. Of a long face the teeth go down and the joints stay.
Similarity3 following_cranium(const SkullTemplate& skull, const TriangleMesh& surface,
                              const Eigen::Affine3d& cranium, const Points3& bent,
                              const Eigen::Vector3d& left, const Eigen::Vector3d& right) {
  constexpr double kJoint_mm = 12.0;
  std::vector<int> members[3];
  for (int v = 0; v < skull.boundary_count; ++v) {
    const SkullRegion region = skull.region[static_cast<std::size_t>(v)];
    if (bone_of(region) != SkullBone::cranium) continue;
    const Eigen::Vector3d place = surface.vertices.row(v);
    if (region == upper_teeth) members[0].push_back(v);
    if ((place - left).norm() < kJoint_mm) members[1].push_back(v);
    if ((place - right).norm() < kJoint_mm) members[2].push_back(v);
  }
  const std::size_t count = members[0].size() + members[1].size() + members[2].size();
  Points3 from(static_cast<Eigen::Index>(count), 3);
  Points3 to(from.rows(), 3);
  Eigen::VectorXd weights(from.rows());
  Eigen::Index row = 0;
  for (const std::vector<int>& of_place : members) {
    for (const int v : of_place) {
      from.row(row) = (cranium * Eigen::Vector3d(surface.vertices.row(v))).transpose();
      to.row(row) = bent.row(v);
      weights[row++] = 1.0 / static_cast<double>(of_place.size());
    }
  }
  return fit_similarity(from, to, weights, FitScale::to_target).value_or(Similarity3{});
}

/// The mandible closed and opened about the axis through its condyles, lower down, and following
/// the cranium. `cranium` is where the unbent one lies, `bent` where its vertices are.
std::vector<Similarity3> mandible_starts(const SkullTemplate& skull, const TriangleMesh& surface,
                                         const Eigen::Affine3d& cranium, const Points3& bent) {
  std::vector<Similarity3> starts;
  std::optional<Eigen::Vector3d> left;
  std::optional<Eigen::Vector3d> right;
  for (const TemplateLandmark& landmark : skull.landmarks) {
    if (landmark.name == "condylion laterale left")
      left = landmark.place.position(surface.vertices);
    if (landmark.name == "condylion laterale right") {
      right = landmark.place.position(surface.vertices);
    }
  }
  if (!left || !right) return {Similarity3{}};
  const Eigen::Vector3d hinge = cranium * Eigen::Vector3d(0.5 * (*left + *right));
  const Eigen::Vector3d axis = (*left - *right).normalized();
  const Similarity3 following = following_cranium(skull, surface, cranium, bent, *left, *right);
  for (const double opening_deg : {0.0, 10.0, 20.0}) {
    Similarity3 opened;
    opened.rotation = Eigen::AngleAxisd(radians(opening_deg), axis);
    opened.translation = hinge - opened.rotation * hinge;
    for (const double drop_mm : {0.0, 10.0, 20.0}) {  // a longer face, a thick disc in the joint
      Similarity3 start = opened;
      start.translation -= drop_mm * Eigen::Vector3d::UnitZ();
      starts.push_back(start);
    }
    starts.push_back(following * opened);
  }
  return starts;
}

Eigen::Affine3d affine(const Similarity3& similarity) {
  Eigen::Affine3d result;
  result.linear() = similarity.scale * similarity.rotation.toRotationMatrix();
  result.translation() = similarity.translation;
  return result;
}

/// The input without what lies on the cranium.
OrientedPoints beyond_cranium(const SkullTemplate& skull, const Points3& bent,
                              const InputSurface& input) {
  constexpr double kOnCranium_mm = 4.0;
  Points3 bone(skull.boundary_count, 3);
  Eigen::Index count = 0;
  for (int v = 0; v < skull.boundary_count; ++v) {
    if (bone_of(skull.region[static_cast<std::size_t>(v)]) != SkullBone::cranium) continue;
    bone.row(count++) = bent.row(v);
  }
  bone.conservativeResize(count, 3);
  const PointTree tree(bone);
  OrientedPoints rest = input.samples();
  count = 0;
  for (Eigen::Index i = 0; i < input.samples().size(); ++i) {
    if (tree.nearest(input.samples().positions.row(i), kOnCranium_mm).index >= 0) continue;
    rest.positions.row(count) = input.samples().positions.row(i);
    rest.normals.row(count++) = input.samples().normals.row(i);
  }
  rest.positions.conservativeResize(count, 3);
  rest.normals.conservativeResize(count, 3);
  return rest;
}

Regions regions_of(SkullBone bone) {
  Regions regions;
  for (int r = 0; r < kSkullRegionCount; ++r) {
    const auto region = static_cast<SkullRegion>(r);
    if (bone_of(region) == bone) regions.push_back(region);
  }
  return regions;
}

Eigen::Affine3d stretched(const OrientedPoints& points, const InputSurface& input,
                          Eigen::Affine3d placed) {
  for (const double reach_mm : {12.0, 6.0}) placed = fit_affine(points, input, placed, reach_mm);
  return placed;
}

}  // namespace

PartAlignment align_cranium(const SkullTemplate& skull, const TriangleMesh& surface,
                            const InputSurface& input) {
  PartAlignment result;
  const Target whole{input.samples(), input.sample_tree()};
  const OrientedPoints points = points_of(skull, surface, regions_of(SkullBone::cranium));
  const auto found = align_part(points, whole, Similarity3{}, {Similarity3{}}, kBone);
  ++result.parts;
  result.accepted += found.has_value() ? 1 : 0;
  // A scan without cranium is refused by its size and shape.
  result.bones.fill(stretched(points, input, affine(found.value_or(Similarity3{}))));
  return result;
}

void find_mandible(const SkullTemplate& skull, const TriangleMesh& surface, const Points3& bent,
                   const InputSurface& input, PartAlignment& parts) {
  const Target whole{input.samples(), input.sample_tree()};
  const Eigen::Affine3d cranium = parts.bones[static_cast<std::size_t>(SkullBone::cranium)];
  const OrientedPoints own = points_of(skull, surface, regions_of(SkullBone::mandible));
  const OrientedPoints points = transformed(cranium, own);
  const OrientedPoints rest = beyond_cranium(skull, bent, input);
  std::optional<Similarity3> found;
  if (rest.size() >= kLeastSamples) {
    const PointTree tree(rest.positions);
    found = align_part(points, {rest, tree, true}, Similarity3{},
                       mandible_starts(skull, surface, cranium, bent), kBone);
  }
  const Similarity3 placed = found.value_or(Similarity3{});
  parts.mandible_found = cost_of(points, placed, whole) < kFoundCost_mm2;
  ++parts.parts;
  parts.accepted += found.has_value() ? 1 : 0;
  Eigen::Affine3d& mandible = parts.bones[static_cast<std::size_t>(SkullBone::mandible)];
  mandible = affine(placed) * cranium;
  if (parts.mandible_found) mandible = stretched(own, input, mandible);
}

void align_regions(const SkullTemplate& skull, const TriangleMesh& surface,
                   const InputSurface& input, int threads, PartAlignment& result) {
  TriangleMesh placed = surface;
  for (int v = 0; v < skull.boundary_count; ++v) {
    const auto bone = static_cast<std::size_t>(bone_of(skull.region[static_cast<std::size_t>(v)]));
    placed.vertices.row(v) = (result.bones[bone] * surface.vertices.row(v).transpose()).transpose();
  }
  placed.normals = vertex_normals(placed);

  const Target whole{input.samples(), input.sample_tree()};
  struct Found {
    Regions regions;
    std::optional<Similarity3> transform;
  };
  const auto level = [&](std::vector<Found> parts, const Bounds& bounds) {
    parallel_for(static_cast<int>(parts.size()), threads, [&](int p) {
      Found& part = parts[static_cast<std::size_t>(p)];
      const Similarity3& parent = result.regions[static_cast<std::size_t>(part.regions.front())];
      part.transform =
          align_part(points_of(skull, placed, part.regions), whole, parent, {parent}, bounds);
    });
    for (const Found& part : parts) {
      ++result.parts;
      if (!part.transform) continue;
      ++result.accepted;
      for (const SkullRegion region : part.regions) {
        result.regions[static_cast<std::size_t>(region)] = *part.transform;
      }
    }
  };
  std::vector<Found> parts;
  for (const Regions& group : groups()) parts.push_back({group, std::nullopt});
  level(std::move(parts), kGroup);
  parts.clear();
  for (int r = 0; r < kSkullRegionCount; ++r) {
    parts.push_back({{static_cast<SkullRegion>(r)}, std::nullopt});
  }
  level(std::move(parts), kRegion);
}

}  // namespace skullstation
