#include "reconstruction/phantom/phantom_ct_scanner.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/parallel.h"
#include "core/random.h"

namespace skullstation {

namespace {

constexpr double kFillingRadius_mm = 2.5;
constexpr double kStreakReach_mm = 25.0;
constexpr float kMetal_hu = 3071.0F;  // where 12-bit scanners end

/// One half of a normalised Gaussian, the centre first.
std::vector<float> gaussian(double sd_voxels) {
  const int reach = static_cast<int>(std::ceil(3.5 * sd_voxels));
  std::vector<float> weights;
  double sum = 0.0;
  for (int i = 0; i <= reach; ++i) {
    const double weight = std::exp(-0.5 * i * i / (sd_voxels * sd_voxels));
    weights.push_back(static_cast<float>(weight));
    sum += i == 0 ? weight : 2.0 * weight;
  }
  for (float& weight : weights) weight /= static_cast<float>(sum);
  return weights;
}

/// Blurs `count` lines of `length` vectors of `width` values each: along x a value at a time, along
/// y and z whole rows or slices at once.
void blur_lines(float* values, int length, std::size_t width, const std::vector<float>& weights,
                std::vector<float>& line) {
  line.assign(values, values + static_cast<std::size_t>(length) * width);
  const int reach = static_cast<int>(weights.size()) - 1;
  for (int i = 0; i < length; ++i) {
    float* out = values + static_cast<std::size_t>(i) * width;
    const float* center = line.data() + static_cast<std::size_t>(i) * width;
    for (std::size_t w = 0; w < width; ++w) out[w] = weights[0] * center[w];
    for (int n = 1; n <= reach; ++n) {
      const float* before = line.data() + static_cast<std::size_t>(std::max(i - n, 0)) * width;
      const float* after =
          line.data() + static_cast<std::size_t>(std::min(i + n, length - 1)) * width;
      for (std::size_t w = 0; w < width; ++w) out[w] += weights[n] * (before[w] + after[w]);
    }
  }
}

}  // namespace

void blur_volume(std::vector<float>& values, const VoxelGrid& grid, double sd_mm, int threads) {
  if (sd_mm <= 0.0) return;
  const std::size_t row = static_cast<std::size_t>(grid.size.x());
  const std::size_t slice = row * static_cast<std::size_t>(grid.size.y());
  const std::vector<float> along_x = gaussian(sd_mm / grid.spacing_mm.x());
  const std::vector<float> along_y = gaussian(sd_mm / grid.spacing_mm.y());
  const std::vector<float> along_z = gaussian(sd_mm / grid.spacing_mm.z());
  parallel_for(grid.size.z(), threads, [&](int k) {
    std::vector<float> line;
    float* plane = values.data() + static_cast<std::size_t>(k) * slice;
    for (int j = 0; j < grid.size.y(); ++j) {
      blur_lines(plane + static_cast<std::size_t>(j) * row, grid.size.x(), 1, along_x, line);
    }
    blur_lines(plane, grid.size.y(), row, along_y, line);
  });
  parallel_for(grid.size.y(), threads, [&](int j) {
    // The plane of one j, gathered, blurred and put back.
    std::vector<float> plane(row * static_cast<std::size_t>(grid.size.z()));
    std::vector<float> line;
    for (int k = 0; k < grid.size.z(); ++k) {
      std::copy_n(values.data() + grid.index(0, j, k), row, plane.data() + row * k);
    }
    blur_lines(plane.data(), grid.size.z(), row, along_z, line);
    for (int k = 0; k < grid.size.z(); ++k) {
      std::copy_n(plane.data() + row * k, row, values.data() + grid.index(0, j, k));
    }
  });
}

void add_metal(std::vector<float>& values, const VoxelGrid& grid,
               const std::vector<Eigen::Vector3d>& metal_mm, double streak_hu, int threads) {
  parallel_for(grid.size.z(), threads, [&](int k) {
    for (const Eigen::Vector3d& metal : metal_mm) {
      const Eigen::Vector3d center = grid.voxel_from_patient(metal).cwiseProduct(grid.spacing_mm);
      const double dz = k * grid.spacing_mm.z() - center.z();
      if (std::abs(dz) > kFillingRadius_mm + grid.spacing_mm.z()) continue;
      const double fade = std::exp(-0.5 * dz * dz / (kFillingRadius_mm * kFillingRadius_mm));
      for (int j = 0; j < grid.size.y(); ++j) {
        for (int i = 0; i < grid.size.x(); ++i) {
          const double dx = i * grid.spacing_mm.x() - center.x();
          const double dy = j * grid.spacing_mm.y() - center.y();
          const double r = std::hypot(dx, dy);
          float& value = values[grid.index(i, j, k)];
          if (std::hypot(r, dz) < kFillingRadius_mm) {
            value = kMetal_hu;
          } else if (r < 4.0 * kStreakReach_mm) {
            // Bright and dark rays, narrower and wider ones mixed.
            const double angle = std::atan2(dy, dx);
            const double rays =
                std::cos(9.0 * angle + center.x()) + std::cos(23.0 * angle + center.y());
            value +=
                static_cast<float>(0.5 * streak_hu * fade * rays * std::exp(-r / kStreakReach_mm));
          }
        }
      }
    }
  });
}

std::vector<std::int16_t> noisy_hu(const std::vector<float>& values, const VoxelGrid& grid,
                                   double noise_sd_hu, std::uint64_t seed, int threads) {
  std::vector<std::int16_t> hu(values.size());
  const std::size_t slice = values.size() / static_cast<std::size_t>(grid.size.z());
  const auto rounded = [](double value) {
    return static_cast<std::int16_t>(std::lround(std::clamp(value, -1024.0, 3071.0)));
  };
  parallel_for(grid.size.z(), threads, [&](int k) {
    Random random(mix(seed, static_cast<std::uint64_t>(k)));
    const std::size_t first = static_cast<std::size_t>(k) * slice;
    for (std::size_t i = first; i < first + slice; ++i) {
      const double noise = noise_sd_hu > 0.0 ? random.normal(0.0, noise_sd_hu) : 0.0;
      hu[i] = rounded(values[i] + noise);
    }
  });
  return hu;
}

}  // namespace skullstation
