#include "reconstruction/approximation/sphere_model.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/volume/isosurface.h"
#include "reconstruction/volume/voxel_components.h"

namespace skullstation {

namespace {

using Eigen::Index;

/// The distance field is kept this far to either side of the surface, in cells.
constexpr double band_cells = 2.0;
constexpr double stored_steps = 10000.0;  // per cell
constexpr std::size_t most_cells = std::size_t{1} << 28;

struct Sphere {
  Eigen::Vector3d centre;  // in cells
  double radius;           // in cells
};

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::bad_input, "sphere model", std::move(what));
}

VoxelGrid grid_around(const Points3& bone, const Eigen::VectorXd& depths_mm, double cell_mm) {
  Eigen::AlignedBox3d box;
  for (Index v = 0; v < bone.rows(); ++v) {
    if (std::isnan(depths_mm[v])) continue;
    const Eigen::Vector3d centre = bone.row(v);
    box.extend(centre - Eigen::Vector3d::Constant(depths_mm[v]));
    box.extend(centre + Eigen::Vector3d::Constant(depths_mm[v]));
  }
  VoxelGrid grid;
  if (box.isEmpty()) return grid;
  const double margin_mm = (band_cells + 2.0) * cell_mm;
  grid.spacing_mm.setConstant(cell_mm);
  grid.origin_mm = box.min() - Eigen::Vector3d::Constant(margin_mm);
  grid.size = ((box.sizes().array() + 2.0 * margin_mm) / cell_mm).ceil().cast<int>() + 1;
  return grid;
}

/// How deep each cell's centre lies inside the union, in cells, cut off at the band's width.
void fill_slice(const VoxelGrid& grid, int k, const std::vector<Sphere>& spheres,
                std::span<float> depth) {
  std::ranges::fill(depth, static_cast<float>(-band_cells));
  for (const Sphere& sphere : spheres) {
    const double dz = k - sphere.centre.z();
    const double reach = sphere.radius + band_cells;
    const double across2 = reach * reach - dz * dz;
    if (across2 <= 0.0) continue;
    const double across = std::sqrt(across2);
    const int j0 = std::max(0, static_cast<int>(std::ceil(sphere.centre.y() - across)));
    const int j1 =
        std::min(grid.size.y() - 1, static_cast<int>(std::floor(sphere.centre.y() + across)));
    for (int j = j0; j <= j1; ++j) {
      const double dy = j - sphere.centre.y();
      const double along2 = across2 - dy * dy;
      if (along2 <= 0.0) continue;
      const double along = std::sqrt(along2);
      const int i0 = std::max(0, static_cast<int>(std::ceil(sphere.centre.x() - along)));
      const int i1 =
          std::min(grid.size.x() - 1, static_cast<int>(std::floor(sphere.centre.x() + along)));
      float* row = depth.data() + static_cast<std::ptrdiff_t>(j) * grid.size.x();
      const double off2 = dz * dz + dy * dy;
      for (int i = i0; i <= i1; ++i) {
        const double dx = i - sphere.centre.x();
        const auto inside = static_cast<float>(sphere.radius - std::sqrt(off2 + dx * dx));
        row[i] = std::max(row[i], std::min(inside, static_cast<float>(band_cells)));
      }
    }
  }
}

}  // namespace

Result<void> SphereModelOptions::validate() const {
  if (!(grid_mm > 0.0)) return bad("grid_mm must be positive");
  if (!(smoothing_mm >= 0.0)) return bad("smoothing_mm must not be negative");
  return {};
}

Eigen::VectorXd smoothed_depths(const TriangleMesh& surface, const Eigen::VectorXd& depths_mm,
                                double smoothing_mm) {
  if (!(smoothing_mm > 0.0)) return depths_mm;
  // Each round of means over the neighbours spreads by about the edges' length.
  double edge2_sum = 0.0;
  for (Index t = 0; t < surface.triangles.rows(); ++t) {
    for (int k = 0; k < 3; ++k) {
      edge2_sum += (surface.vertices.row(surface.triangles(t, k)) -
                    surface.vertices.row(surface.triangles(t, (k + 1) % 3)))
                       .squaredNorm();
    }
  }
  const double edge2 =
      edge2_sum / std::max(1.0, 3.0 * static_cast<double>(surface.triangles.rows()));
  // Half of the weight goes to the neighbours: variance edge^2 / 2 a round, shared by two axes.
  const int rounds = std::max(
      1, static_cast<int>(std::lround(4.0 * smoothing_mm * smoothing_mm / std::max(edge2, 1e-9))));
  Eigen::VectorXd depths = depths_mm;
  for (int round = 0; round < rounds; ++round) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(depths.size());
    Eigen::VectorXd count = Eigen::VectorXd::Zero(depths.size());
    for (Index t = 0; t < surface.triangles.rows(); ++t) {
      for (int k = 0; k < 3; ++k) {
        const int a = surface.triangles(t, k);
        for (const int b : {surface.triangles(t, (k + 1) % 3), surface.triangles(t, (k + 2) % 3)}) {
          if (std::isnan(depths[b])) continue;
          sum[a] += depths[b];
          count[a] += 1.0;
        }
      }
    }
    for (Index v = 0; v < depths.size(); ++v) {
      if (count[v] > 0.0) depths[v] = 0.5 * depths[v] + 0.5 * sum[v] / count[v];
    }
  }
  return depths;
}

Result<TriangleMesh> sphere_model(const Points3& bone, const Eigen::VectorXd& depths_mm,
                                  const SphereModelOptions& options) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (depths_mm.size() != bone.rows()) {
    return bad(fmt::format("{} depths for {} vertices", depths_mm.size(), bone.rows()));
  }
  const VoxelGrid grid = grid_around(bone, depths_mm, options.grid_mm);
  if (grid.size.minCoeff() == 0) return bad("no vertex has a depth");
  if (grid.size.cast<double>().prod() > static_cast<double>(most_cells)) {
    return bad(fmt::format("{} x {} x {} cells are too many", grid.size.x(), grid.size.y(),
                           grid.size.z()));
  }
  std::vector<Sphere> spheres;
  for (Index v = 0; v < bone.rows(); ++v) {
    if (std::isnan(depths_mm[v])) continue;
    spheres.push_back(
        {grid.voxel_from_patient(bone.row(v).transpose()), depths_mm[v] / options.grid_mm});
  }
  std::vector<std::int16_t> stored(grid.count());
  const std::size_t slice = static_cast<std::size_t>(grid.size.x()) * grid.size.y();
  parallel_for(grid.size.z(), options.threads, [&](int k) {
    std::vector<float> depth(slice);
    fill_slice(grid, k, spheres, depth);
    for (std::size_t i = 0; i < slice; ++i) {
      stored[static_cast<std::size_t>(k) * slice + i] =
          static_cast<std::int16_t>(std::lround(depth[i] * stored_steps));
    }
  });

  // What the outside does not reach is inside. The grid's border lies outside.
  VoxelMask outside(grid.size);
  for (std::size_t i = 0; i < stored.size(); ++i) outside.on[i] = stored[i] <= 0 ? 1 : 0;
  const VoxelComponents hollows(outside, Connectivity::face6);
  const int open = hollows.at(0, 0, 0);
  hollows.for_each_run([&](const VoxelRun& run, int j, int k) {
    if (run.component == open) return;
    for (int i = run.begin; i < run.end; ++i) stored[grid.index(i, j, k)] = stored_steps;
  });
  TriangleMesh mesh = isosurface(grid, stored, 0.0, options.threads);
  mesh.normals = vertex_normals(mesh);
  return mesh;
}

}  // namespace skullstation
