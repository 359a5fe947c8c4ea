#include "reconstruction/photogrammetry/visual_hull.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "core/parallel.h"

namespace skullstation {

namespace {

/// Answers "is there any specimen in this rectangle?" of a mask at a quarter of its size.
class MaskTable {
 public:
  explicit MaskTable(const StereoView& view)
      : view_(view), width_(view.mask.width / kCell), height_(view.mask.height / kCell) {
    sums_.assign(static_cast<std::size_t>(width_ + 1) * (height_ + 1), 0);
    for (int y = 0; y < height_; ++y) {
      int row = 0;
      for (int x = 0; x < width_; ++x) {
        bool any = false;
        for (int j = 0; j < kCell; ++j) {
          for (int i = 0; i < kCell; ++i) any |= view.mask.at(kCell * x + i, kCell * y + j) >= 64;
        }
        row += any ? 1 : 0;
        at(x + 1, y + 1) = at(x + 1, y) + row;
      }
    }
  }

  /// May the ball hold a piece of the specimen, as far as this view can tell?
  bool allows(const Eigen::Vector3d& centre, double radius) const {
    const Eigen::Vector3d x_camera = view_.camera_from_table * centre;
    if (x_camera.z() <= radius) return true;
    const Eigen::Vector2d p = view_.camera.project(x_camera);
    const double r = radius * view_.camera.fx / x_camera.z();
    const int left = cell(p.x() - r), right = cell(p.x() + r) + 1;
    const int top = cell(p.y() - r), bottom = cell(p.y() + r) + 1;
    if (view_.cut_by_frame && (left < 0 || top < 0 || right > width_ || bottom > height_)) {
      return true;
    }
    const int l = std::clamp(left, 0, width_), h = std::clamp(right, 0, width_);
    const int t = std::clamp(top, 0, height_), b = std::clamp(bottom, 0, height_);
    return at(h, b) - at(l, b) - at(h, t) + at(l, t) > 0;
  }

 private:
  static constexpr int kCell = 4;
  static int cell(double px) {
    return static_cast<int>(std::floor(std::clamp(px, -1e6, 1e6) / kCell));
  }
  int& at(int x, int y) { return sums_[static_cast<std::size_t>(y) * (width_ + 1) + x]; }
  int at(int x, int y) const { return sums_[static_cast<std::size_t>(y) * (width_ + 1) + x]; }

  const StereoView& view_;
  int width_, height_;
  std::vector<int> sums_;
};

struct Cube {
  Eigen::Vector3d centre;
  double half_mm;
};

/// A cube around the point nearest to the rays through the masks' middles, large enough for what
/// the views that see all of the specimen see of it.
Cube first_cube(std::span<const StereoView> views) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const StereoView& view : views) {
    const Rigid3 table_from_camera = view.camera_from_table.inverse();
    const Eigen::Vector3d direction =
        (table_from_camera.rotation *
         view.camera.ray(0.5 * view.camera.width, 0.5 * view.camera.height))
            .normalized();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    normal += across;
    right += across * table_from_camera.translation;
  }
  Cube cube{normal.ldlt().solve(right), 0.0};
  for (const StereoView& view : views) {
    const double diagonal_px = 0.5 * std::hypot(view.camera.width, view.camera.height);
    const double distance = (view.camera_from_table * cube.centre).norm();
    cube.half_mm = std::max(cube.half_mm, diagonal_px / view.camera.fx * distance);
  }
  cube.half_mm *= 1.1;
  return cube;
}

VisualHull carve(const std::vector<MaskTable>& masks, const Eigen::Vector3d& low,
                 const Eigen::Vector3d& high, double voxel_mm, int threads) {
  VisualHull hull;
  hull.origin_mm = low;
  hull.voxel_mm = voxel_mm;
  hull.size = ((high - low) / voxel_mm).array().ceil().matrix().cast<int>().cwiseMax(1);
  hull.inside.assign(static_cast<std::size_t>(hull.size.prod()), 0);
  const double radius = 0.5 * std::sqrt(3.0) * voxel_mm;
  const auto count = static_cast<int>(masks.size());
  // Views far apart first: the second is the likeliest to cut what the first allows.
  int stride = std::max(1, count / 4);
  while (std::gcd(stride, count) != 1) ++stride;
  parallel_for(hull.size.z(), threads, [&](int z) {
    for (int y = 0; y < hull.size.y(); ++y) {
      for (int x = 0; x < hull.size.x(); ++x) {
        const Eigen::Vector3d centre =
            hull.origin_mm + voxel_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        bool allowed = true;
        for (int i = 0; i < count && allowed; ++i) {
          allowed = masks[(i * stride) % count].allows(centre, radius);
        }
        hull.inside[hull.index(x, y, z)] = allowed ? 1 : 0;
      }
    }
  });
  return hull;
}

/// Corners of the box around the voxels inside, grown by a voxel; false if there are none.
bool occupied_box(const VisualHull& hull, Eigen::Vector3d& low, Eigen::Vector3d& high) {
  Eigen::Vector3i first = hull.size;
  Eigen::Vector3i last = Eigen::Vector3i::Constant(-1);
  for (int z = 0; z < hull.size.z(); ++z) {
    for (int y = 0; y < hull.size.y(); ++y) {
      for (int x = 0; x < hull.size.x(); ++x) {
        if (hull.inside[hull.index(x, y, z)] == 0) continue;
        first = first.cwiseMin(Eigen::Vector3i(x, y, z));
        last = last.cwiseMax(Eigen::Vector3i(x, y, z));
      }
    }
  }
  if (last.x() < 0) return false;
  low = hull.origin_mm + hull.voxel_mm * (first.cast<double>().array() - 1.0).matrix();
  high = hull.origin_mm + hull.voxel_mm * (last.cast<double>().array() + 2.0).matrix();
  return true;
}

}  // namespace

Eigen::Vector3d VisualHull::centre_mm() const {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  for (int z = 0; z < size.z(); ++z) {
    for (int y = 0; y < size.y(); ++y) {
      for (int x = 0; x < size.x(); ++x) {
        if (inside[index(x, y, z)] == 0) continue;
        sum += Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        ++count;
      }
    }
  }
  return origin_mm + voxel_mm * sum / static_cast<double>(std::max<std::size_t>(count, 1));
}

Result<VisualHull> carve_visual_hull(std::span<const StereoView> views, int resolution,
                                     int threads) {
  std::vector<MaskTable> masks;
  masks.reserve(views.size());
  for (const StereoView& view : views) masks.emplace_back(view);
  const Cube cube = first_cube(views);
  Eigen::Vector3d low = cube.centre.array() - cube.half_mm;
  Eigen::Vector3d high = cube.centre.array() + cube.half_mm;
  for (const int cells : {std::min(resolution, 48), resolution}) {
    VisualHull hull = carve(masks, low, high, (high - low).maxCoeff() / cells, threads);
    if (!occupied_box(hull, low, high)) {
      return fail(ErrorKind::no_result, "visual hull",
                  "there is no point that all masks show as specimen",
                  "check that poses and masks belong together and that the specimen did not move");
    }
    if (cells == resolution) return hull;
  }
  return fail(ErrorKind::usage, "visual hull", "resolution must be positive");
}

HullRange hull_range(const VisualHull& hull, const Pinhole& camera,
                     const Rigid3& camera_from_table) {
  HullRange range{camera.width, camera.height, {}, {}};
  const auto pixels = static_cast<std::size_t>(camera.width) * camera.height;
  range.nearest.assign(pixels, 0.0f);
  range.farthest.assign(pixels, 0.0f);
  const auto is_inside = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < hull.size.x() && y < hull.size.y() &&
           z < hull.size.z() && hull.inside[hull.index(x, y, z)] != 0;
  };
  const double radius = 0.5 * std::sqrt(3.0) * hull.voxel_mm;
  for (int z = 0; z < hull.size.z(); ++z) {
    for (int y = 0; y < hull.size.y(); ++y) {
      for (int x = 0; x < hull.size.x(); ++x) {
        if (!is_inside(x, y, z)) continue;
        const bool buried = is_inside(x - 1, y, z) && is_inside(x + 1, y, z) &&
                            is_inside(x, y - 1, z) && is_inside(x, y + 1, z) &&
                            is_inside(x, y, z - 1) && is_inside(x, y, z + 1);
        if (buried) continue;
        const Eigen::Vector3d centre =
            hull.origin_mm + hull.voxel_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        const Eigen::Vector3d x_camera = camera_from_table * centre;
        if (x_camera.z() <= 2.0 * radius) continue;
        const Eigen::Vector2d p = camera.project(x_camera);
        const double reach = radius * camera.fx / x_camera.z();
        const auto near = static_cast<float>(1.0 / (x_camera.z() - radius));
        const auto far = static_cast<float>(1.0 / (x_camera.z() + radius));
        const int left = std::max(0, static_cast<int>(std::floor(p.x() - reach)));
        const int right = std::min(camera.width - 1, static_cast<int>(std::floor(p.x() + reach)));
        const int top = std::max(0, static_cast<int>(std::floor(p.y() - reach)));
        const int bottom = std::min(camera.height - 1, static_cast<int>(std::floor(p.y() + reach)));
        for (int v = top; v <= bottom; ++v) {
          for (int u = left; u <= right; ++u) {
            const std::size_t i = static_cast<std::size_t>(v) * camera.width + u;
            range.nearest[i] = std::max(range.nearest[i], near);
            range.farthest[i] = range.farthest[i] == 0.0f ? far : std::min(range.farthest[i], far);
          }
        }
      }
    }
  }
  return range;
}

}  // namespace skullstation
