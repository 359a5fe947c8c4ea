#include "reconstruction/volume/volume.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string_view>
#include <utility>

#include "core/file.h"

namespace skullstation {

namespace {

struct AxisMap {
  int source = 0;        ///< the old axis
  bool flipped = false;  ///< runs against it
};

/// For each patient axis the voxel axis that lies closest to it; each is used once.
std::array<AxisMap, 3> nearest_axes(const Eigen::Matrix3d& direction) {
  std::array<AxisMap, 3> axes;
  std::array<bool, 3> patient_done{};
  std::array<bool, 3> voxel_done{};
  for (int step = 0; step < 3; ++step) {
    double best = -1.0;
    int patient = 0;
    int voxel = 0;
    for (int p = 0; p < 3; ++p) {
      for (int v = 0; v < 3; ++v) {
        const double cosine = std::abs(direction(p, v));
        if (patient_done[static_cast<std::size_t>(p)] || voxel_done[static_cast<std::size_t>(v)] ||
            cosine <= best) {
          continue;
        }
        best = cosine;
        patient = p;
        voxel = v;
      }
    }
    patient_done[static_cast<std::size_t>(patient)] = true;
    voxel_done[static_cast<std::size_t>(voxel)] = true;
    axes[static_cast<std::size_t>(patient)] = {voxel, direction(patient, voxel) < 0.0};
  }
  return axes;
}

}  // namespace

Volume oriented_to_patient_axes(Volume volume) {
  const auto axes = nearest_axes(volume.grid.direction);
  bool unchanged = true;
  for (int a = 0; a < 3; ++a) {
    unchanged = unchanged && axes[static_cast<std::size_t>(a)].source == a &&
                !axes[static_cast<std::size_t>(a)].flipped;
  }
  if (unchanged) return volume;

  const VoxelGrid& old = volume.grid;
  VoxelGrid grid;
  const std::array<std::ptrdiff_t, 3> old_stride{
      1, old.size.x(), static_cast<std::ptrdiff_t>(old.size.x()) * old.size.y()};
  std::array<std::ptrdiff_t, 3> stride{};
  std::ptrdiff_t start = 0;
  Eigen::Vector3d first_voxel = Eigen::Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    const AxisMap& map = axes[static_cast<std::size_t>(a)];
    grid.size[a] = old.size[map.source];
    grid.spacing_mm[a] = old.spacing_mm[map.source];
    grid.direction.col(a) = (map.flipped ? -1.0 : 1.0) * old.direction.col(map.source);
    stride[static_cast<std::size_t>(a)] =
        (map.flipped ? -1 : 1) * old_stride[static_cast<std::size_t>(map.source)];
    if (!map.flipped) continue;
    first_voxel[map.source] = old.size[map.source] - 1;
    start += old_stride[static_cast<std::size_t>(map.source)] * (old.size[map.source] - 1);
  }
  grid.origin_mm = old.patient_from_voxel(first_voxel);

  std::vector<std::int16_t> hu(grid.count());
  std::size_t to = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    for (int j = 0; j < grid.size.y(); ++j) {
      std::ptrdiff_t from = start + k * stride[2] + j * stride[1];
      for (int i = 0; i < grid.size.x(); ++i, from += stride[0]) {
        hu[to++] = volume.hu[static_cast<std::size_t>(from)];
      }
    }
  }
  return {grid, std::move(hu), std::move(volume.info)};
}

std::string volume_sha256(const Volume& volume) {
  const VoxelGrid& g = volume.grid;
  std::string geometry = fmt::format("{} {} {};", g.size.x(), g.size.y(), g.size.z());
  const auto add = [&](double value) { geometry += fmt::format("{:.6f};", value + 0.0); };
  for (int a = 0; a < 3; ++a) add(g.spacing_mm[a]);
  for (int a = 0; a < 3; ++a) add(g.origin_mm[a]);
  for (int a = 0; a < 9; ++a) add(g.direction(a % 3, a / 3));
  const std::string_view voxels(reinterpret_cast<const char*>(volume.hu.data()),
                                volume.hu.size() * sizeof(std::int16_t));
  return sha256_hex(geometry + sha256_hex(voxels));
}

}  // namespace skullstation
