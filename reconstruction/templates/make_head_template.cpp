#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/implicit_solid.h"
#include "reconstruction/registration/surface_places.h"
#include "reconstruction/templates/head_regions.h"
#include "reconstruction/templates/make_templates.h"
#include "reconstruction/templates/remeshing.h"

namespace skullstation {

namespace {

/// The sheet ends in this plane, above the cut through the canonical neck.
constexpr double kNeckZ_mm = -108.0;
/// Vertices this near to a plane were cut in it.
constexpr double kInPlane_mm = 1e-6;

double relative_edge(HeadRegion region) {
  switch (region) {
    case HeadRegion::nose:
    case HeadRegion::lips:
    case HeadRegion::eyes: return 0.65;
    case HeadRegion::ears: return 0.85;
    case HeadRegion::face: return 1.1;
    case HeadRegion::scalp: return 2.2;
    case HeadRegion::neck: return 2.0;
  }
  return 1.0;
}

double data_weight(HeadRegion region) {
  switch (region) {
    case HeadRegion::ears: return 0.3;  // folds that scans show in part
    case HeadRegion::scalp:             // hair
    case HeadRegion::neck: return 0.5;  // clothes, cables, the scan's end
    default: return 1.0;
  }
}

/// The region's wanted length, smoothed over its borders: a mean over points about it.
double smoothed_edge_mm(const Eigen::Vector3d& point, double face_edge_mm) {
  constexpr double kReach_mm = 8.0;
  double sum = 2.0 * relative_edge(head_region_at(point));
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-kReach_mm, kReach_mm}) {
      sum += relative_edge(head_region_at(point + side * Eigen::Vector3d::Unit(axis)));
    }
  }
  return face_edge_mm * sum / 8.0;
}

/// Onto the zero surface of the solid along its gradient, `free` directions only.
Eigen::Vector3d onto_surface(const ImplicitSolid& solid, Eigen::Vector3d point,
                             const Eigen::Vector3d& free) {
  for (int step = 0; step < 4; ++step) {
    constexpr double kStep_mm = 0.05;
    const double distance = solid.distance_mm(point);
    if (std::abs(distance) < 1e-4) break;
    Eigen::Vector3d gradient;
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d offset = kStep_mm * Eigen::Vector3d::Unit(axis);
      gradient[axis] = (solid.distance_mm(point + offset) - solid.distance_mm(point - offset)) /
                       (2.0 * kStep_mm);
    }
    gradient = gradient.cwiseProduct(free);
    const double squared = gradient.squaredNorm();
    if (squared < 0.01) break;  // a fold: where it is, it may stay
    Eigen::Vector3d move = -distance / squared * gradient;
    if (move.norm() > 1.0) move.normalize();
    point += move;
  }
  return point;
}

/// The left half, open in the midplane and at the neck.
TriangleMesh left_half(double face_edge_mm, int threads) {
  const double grid_mm = std::clamp(0.7 * face_edge_mm, 1.0, 3.0);
  TriangleMesh half = canonical_skin(grid_mm, threads);
  half = clipped(half, Eigen::Vector3d::UnitX(), 0.0, 0.25 * grid_mm);
  half = clipped(half, Eigen::Vector3d::UnitZ(), kNeckZ_mm, 0.25 * grid_mm);
  const auto solid = skin_solid();
  RemeshingOptions options;
  options.edge_mm = [&](const Eigen::Vector3d& p) { return smoothed_edge_mm(p, face_edge_mm); };
  options.is_corner = [](const Eigen::Vector3d& p) {
    return std::abs(p.x()) < kInPlane_mm && std::abs(p.z() - kNeckZ_mm) < kInPlane_mm;
  };
  options.project = [&](const Eigen::Vector3d& point, const Eigen::Vector3d& before) {
    Eigen::Vector3d free = Eigen::Vector3d::Ones();
    Eigen::Vector3d start = point;
    if (std::abs(before.x()) < kInPlane_mm) {
      free.x() = 0.0;
      start.x() = 0.0;
    } else {
      start.x() = std::max(start.x(), 0.1);
    }
    if (std::abs(before.z() - kNeckZ_mm) < kInPlane_mm) {
      free.z() = 0.0;
      start.z() = kNeckZ_mm;
    }
    return onto_surface(*solid, start, free);
  };
  return remeshed(half, options);
}

/// The half with all of its boundary but the neck's exactly in the midplane, or its mirror image
/// would not meet it there; without the triangles that lie in that plane then.
TriangleMesh closed_in_midplane(TriangleMesh half) {
  const auto in_neck = [&](int v) {
    return std::abs(half.vertices(v, 2) - kNeckZ_mm) < kInPlane_mm;
  };
  const std::vector<std::array<bool, 3>> boundary = boundary_edges(half.triangles);
  for (Eigen::Index f = 0; f < half.triangles.rows(); ++f) {
    for (int side = 0; side < 3; ++side) {
      const int from = half.triangles(f, side);
      const int to = half.triangles(f, (side + 1) % 3);
      if (!boundary[static_cast<std::size_t>(f)][static_cast<std::size_t>(side)] ||
          (in_neck(from) && in_neck(to))) {
        continue;
      }
      half.vertices(from, 0) = 0.0;
      half.vertices(to, 0) = 0.0;
    }
  }
  return submesh(half, [&](Eigen::Index f) {
    return (half.vertices(half.triangles.row(f).transpose(), 0).array() != 0.0).any();
  });
}

}  // namespace

Result<void> HeadTemplateOptions::validate() const {
  if (!(face_edge_mm >= 1.5 && face_edge_mm <= 15.0)) {
    return fail(ErrorKind::usage, "head edge", fmt::format("{} mm", face_edge_mm),
                "give a length from 1.5 to 15 mm");
  }
  return {};
}

Result<HeadTemplate> make_head_template(const HeadTemplateOptions& options,
                                        const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  progress.report(0.0, "meshing the skin");
  const TriangleMesh half = closed_in_midplane(left_half(options.face_edge_mm, options.threads));
  if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "template", "cancelled");

  HeadTemplate head;
  const auto count = static_cast<int>(half.vertices.rows());
  std::vector<int> right(static_cast<std::size_t>(count));
  int next = count;
  for (int v = 0; v < count; ++v) {
    right[static_cast<std::size_t>(v)] = half.vertices(v, 0) == 0.0 ? v : next++;
  }
  head.vertices.resize(next, 3);
  head.mirror.resize(static_cast<std::size_t>(next));
  for (int v = 0; v < count; ++v) {
    const int other = right[static_cast<std::size_t>(v)];
    head.vertices.row(v) = half.vertices.row(v);
    head.vertices.row(other) << -half.vertices(v, 0), half.vertices(v, 1), half.vertices(v, 2);
    head.mirror[static_cast<std::size_t>(v)] = other;
    head.mirror[static_cast<std::size_t>(other)] = v;
  }
  const Eigen::Index faces = half.triangles.rows();
  head.triangles.resize(2 * faces, 3);
  for (Eigen::Index f = 0; f < faces; ++f) {
    head.triangles.row(f) = half.triangles.row(f);
    head.triangles.row(faces + f) << right[static_cast<std::size_t>(half.triangles(f, 0))],
        right[static_cast<std::size_t>(half.triangles(f, 2))],
        right[static_cast<std::size_t>(half.triangles(f, 1))];
  }
  for (int v = 0; v < next; ++v) {
    const HeadRegion region = head_region_at(head.vertices.row(v));
    head.region.push_back(region);
    head.data_weight.push_back(data_weight(region));
  }
  const SurfacePlaces places(surface_of(head, head.vertices));
  for (const Landmark& landmark : canonical_skin_landmarks()) {
    head.landmarks.push_back({landmark.name, places.nearest(landmark.position_mm)});
  }
  if (const auto valid = head.validate(); !valid) return forward(valid);
  return head;
}

}  // namespace skullstation
