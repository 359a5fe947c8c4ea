#include "reconstruction/volume/morphology.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/parallel.h"

namespace skullstation {

namespace {

constexpr float infinite = std::numeric_limits<float>::infinity();

/// The lower envelope of parabolas with apexes `heights` at equal steps; replaces `heights` by its
/// value at each step. Felzenszwalb & Huttenlocher 2012, section 2.
class ParabolaEnvelope {
 public:
  explicit ParabolaEnvelope(std::size_t size) : apex_(size), begin_(size + 1), result_(size) {}

  void apply(std::vector<float>& heights, double step_mm) {
    const double step2 = step_mm * step_mm;
    int last = -1;
    for (std::size_t q = 0; q < heights.size(); ++q) {
      if (heights[q] == infinite) continue;
      double cross = -std::numeric_limits<double>::infinity();
      while (last >= 0) {
        const auto p = apex_[static_cast<std::size_t>(last)];
        const double dq = static_cast<double>(q);
        const double dp = static_cast<double>(p);
        cross = ((heights[q] - heights[p]) / step2 + dq * dq - dp * dp) / (2.0 * (dq - dp));
        if (cross > begin_[static_cast<std::size_t>(last)]) break;
        --last;
        cross = -std::numeric_limits<double>::infinity();
      }
      ++last;
      apex_[static_cast<std::size_t>(last)] = q;
      begin_[static_cast<std::size_t>(last)] = cross;
    }
    if (last < 0) return;
    int piece = 0;
    for (std::size_t q = 0; q < heights.size(); ++q) {
      const double dq = static_cast<double>(q);
      while (piece < last && begin_[static_cast<std::size_t>(piece) + 1] < dq) ++piece;
      const auto p = apex_[static_cast<std::size_t>(piece)];
      const double away = dq - static_cast<double>(p);
      result_[q] = static_cast<float>(away * away * step2 + heights[p]);
    }
    std::copy(result_.begin(), result_.end(), heights.begin());
  }

 private:
  std::vector<std::size_t> apex_;
  std::vector<double> begin_;  // where each parabola becomes the lowest
  std::vector<float> result_;
};

}  // namespace

std::vector<float> squared_distance_mm2(const VoxelMask& mask, const Eigen::Vector3d& spacing_mm,
                                        int threads) {
  const Eigen::Vector3i size = mask.size;
  std::vector<float> distance(mask.on.size());
  std::transform(mask.on.begin(), mask.on.end(), distance.begin(),
                 [](std::uint8_t on) { return on != 0 ? 0.0F : infinite; });
  const std::size_t width = static_cast<std::size_t>(size.x());
  const std::size_t slice = width * static_cast<std::size_t>(size.y());
  // Along i and j slice by slice, then along k row by row.
  parallel_for(size.z(), threads, [&](int k) {
    std::vector<float> line(width);
    ParabolaEnvelope along_i(width);
    ParabolaEnvelope along_j(static_cast<std::size_t>(size.y()));
    float* first = distance.data() + static_cast<std::size_t>(k) * slice;
    for (int j = 0; j < size.y(); ++j) {
      float* row = first + static_cast<std::size_t>(j) * width;
      line.assign(row, row + width);
      along_i.apply(line, spacing_mm.x());
      std::copy(line.begin(), line.end(), row);
    }
    line.resize(static_cast<std::size_t>(size.y()));
    for (std::size_t i = 0; i < width; ++i) {
      for (std::size_t j = 0; j < line.size(); ++j) line[j] = first[j * width + i];
      along_j.apply(line, spacing_mm.y());
      for (std::size_t j = 0; j < line.size(); ++j) first[j * width + i] = line[j];
    }
  });
  parallel_for(size.y(), threads, [&](int j) {
    std::vector<float> line(static_cast<std::size_t>(size.z()));
    ParabolaEnvelope along_k(line.size());
    for (std::size_t i = 0; i < width; ++i) {
      float* first = distance.data() + static_cast<std::size_t>(j) * width + i;
      for (std::size_t k = 0; k < line.size(); ++k) line[k] = first[k * slice];
      along_k.apply(line, spacing_mm.z());
      for (std::size_t k = 0; k < line.size(); ++k) first[k * slice] = line[k];
    }
  });
  return distance;
}

VoxelMask dilated(const VoxelMask& mask, double radius_mm, const Eigen::Vector3d& spacing_mm,
                  int threads) {
  const auto distance = squared_distance_mm2(mask, spacing_mm, threads);
  const auto limit = static_cast<float>(radius_mm * radius_mm);
  VoxelMask result(mask.size);
  for (std::size_t v = 0; v < distance.size(); ++v) result.on[v] = distance[v] <= limit ? 1 : 0;
  return result;
}

VoxelMask eroded(const VoxelMask& mask, double radius_mm, const Eigen::Vector3d& spacing_mm,
                 int threads) {
  return inverted(dilated(inverted(mask), radius_mm, spacing_mm, threads));
}

VoxelMask inverted(VoxelMask mask) {
  for (std::uint8_t& on : mask.on) on = on != 0 ? 0 : 1;
  return mask;
}

VoxelMask reachable_from_outside(const VoxelMask& mask) {
  const VoxelComponents free(inverted(mask), Connectivity::face6);
  std::vector<bool> outside(free.all().size(), false);
  const Eigen::Vector3i last = mask.size - Eigen::Vector3i::Ones();
  for (std::size_t c = 0; c < outside.size(); ++c) {
    const auto& component = free.all()[c];
    outside[c] = component.least.x() == 0 || component.least.y() == 0 ||
                 component.most.x() == last.x() || component.most.y() == last.y() ||
                 component.most.z() == last.z();
  }
  return free.mask_of(outside);
}

}  // namespace skullstation
