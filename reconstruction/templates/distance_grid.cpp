#include "reconstruction/templates/distance_grid.h"

#include <algorithm>
#include <cmath>
#include <memory>

#include "core/parallel.h"

namespace skullstation {

namespace {
constexpr int kBlock = 8;  ///< cells along the edge of a block that shares its strokes
}

DistanceGrid::DistanceGrid(const ImplicitSolid& solid, double cell_mm, int threads)
    : cell_mm_(cell_mm) {
  const Eigen::AlignedBox3d box = solid.bounds();
  // A cell of margin on every side.
  origin_ = box.min() - Eigen::Vector3d::Constant(cell_mm);
  const Eigen::Array3i blocks =
      ((box.sizes().array() + 3.0 * cell_mm) / (kBlock * cell_mm)).ceil().cast<int>();
  counts_ = blocks * kBlock;
  values_.resize(static_cast<std::size_t>(counts_.prod()));
  const double reach_mm = 0.5 * kBlock * std::sqrt(3.0) * cell_mm;
  parallel_for(blocks.prod(), threads, [&](int slot) {
    const Eigen::Array3i first =
        kBlock * Eigen::Array3i(slot % blocks.x(), slot / blocks.x() % blocks.y(),
                                slot / (blocks.x() * blocks.y()));
    const auto fill = [&](const auto& value) {
      for (int i = 0; i < kBlock * kBlock * kBlock; ++i) {
        const Eigen::Array3i p =
            first + Eigen::Array3i(i % kBlock, i / kBlock % kBlock, i / (kBlock * kBlock));
        values_[static_cast<std::size_t>((p.z() * counts_.y() + p.y()) * counts_.x() + p.x())] =
            static_cast<float>(value(origin_ + cell_mm * p.matrix().cast<double>()));
      }
    };
    const Eigen::Vector3d center =
        origin_ +
        cell_mm * (first.cast<double>() + Eigen::Array3d::Constant(0.5 * (kBlock - 1))).matrix();
    const double there = solid.distance_mm(center);
    if (std::abs(there) > 1.6 * reach_mm) {
      fill([&](const Eigen::Vector3d&) { return there; });
      return;
    }
    const std::unique_ptr<ImplicitSolid> near = solid.near_ball(center, reach_mm, 3.0 * cell_mm);
    fill([&](const Eigen::Vector3d& p) { return near->distance_mm(p); });
  });
}

double DistanceGrid::distance_mm(const Eigen::Vector3d& point) const {
  const Eigen::Array3d place = (point - origin_).array() / cell_mm_;
  const Eigen::Array3i low = place.floor().cast<int>();
  if ((low < 0).any() || (low + 1 >= counts_).any()) return cell_mm_;
  const Eigen::Array3d f = place - low.cast<double>();
  const auto along_x = [&](int y, int z) {
    const Eigen::Array3i p = low + Eigen::Array3i(0, y, z);
    return (1.0 - f.x()) * at(p) + f.x() * at(p + Eigen::Array3i(1, 0, 0));
  };
  return (1.0 - f.z()) * ((1.0 - f.y()) * along_x(0, 0) + f.y() * along_x(1, 0)) +
         f.z() * ((1.0 - f.y()) * along_x(0, 1) + f.y() * along_x(1, 1));
}

}  // namespace skullstation
