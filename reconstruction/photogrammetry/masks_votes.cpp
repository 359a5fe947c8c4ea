#include "reconstruction/photogrammetry/masks_votes.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/parallel.h"

namespace skullstation {

namespace {

/// The point closest to all optical axes.
std::optional<Eigen::Vector3d> common_target(std::span<const MaskView> views) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const MaskView& view : views) {
    const Rigid3 table_from_camera = view.camera_from_table.inverse();
    const Eigen::Vector3d axis = table_from_camera.rotation * Eigen::Vector3d::UnitZ();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    normal += across;
    right += across * table_from_camera.translation;
  }
  const Eigen::LDLT<Eigen::Matrix3d> factor(normal);
  if (factor.info() != Eigen::Success ||
      !(factor.vectorD().minCoeff() > 1e-3 * static_cast<double>(views.size()))) {
    return std::nullopt;
  }
  return factor.solve(right);
}

/// Reduced pixel that shows the point; nothing outside the picture.
bool locate(const MaskView& view, const Eigen::Vector3d& x_table, int width, int height, int& x,
            int& y) {
  const Eigen::Vector3d x_camera = view.camera_from_table * x_table;
  if (!(x_camera.z() > 1.0)) return false;
  // Far outside the picture the distortion may fold back into it.
  const Eigen::Vector2d straight(x_camera.x() / x_camera.z(), x_camera.y() / x_camera.z());
  const double limit =
      0.75 * std::max(view.lens.width / view.lens.fx, view.lens.height / view.lens.fy);
  if (straight.cwiseAbs().maxCoeff() > limit) return false;
  const Eigen::Vector2d px = view.lens.project(x_camera) / kMaskScale;
  x = static_cast<int>(std::floor(px.x()));
  y = static_cast<int>(std::floor(px.y()));
  return x >= 0 && y >= 0 && x < width && y < height;
}

}  // namespace

Result<VoteHull> vote_hull(std::span<const MaskView> views,
                           std::span<const Image<MaskEvidence>> evidence,
                           const VoteOptions& options) {
  const auto target = common_target(views);
  if (!target) {
    return fail(ErrorKind::no_result, "masks", "the cameras don't look at a common point",
                "check the poses");
  }
  double half_mm = 0.0;
  for (const MaskView& view : views) {
    const double distance = (view.camera_from_table * *target).z();
    half_mm = std::max(
        half_mm,
        0.5 * distance * std::max(view.lens.width / view.lens.fx, view.lens.height / view.lens.fy));
  }
  VoteHull hull;
  hull.side = options.side;
  hull.voxel_mm = 2.0 * half_mm / options.side;
  hull.origin_mm = *target - Eigen::Vector3d::Constant(half_mm);
  if (!(half_mm > 0.0)) {
    return fail(ErrorKind::no_result, "masks", "the cameras look away from each other",
                "check the poses");
  }
  if (options.floor_mm) {
    // Whole voxels lie above the floor.
    hull.origin_mm.z() = std::max(hull.origin_mm.z(), *options.floor_mm);
  }
  hull.inside.assign(static_cast<std::size_t>(hull.side) * hull.side * hull.side, 0);
  parallel_for(hull.side, options.threads, [&](int z) {
    for (int y = 0; y < hull.side; ++y) {
      for (int x = 0; x < hull.side; ++x) {
        const Eigen::Vector3d centre =
            hull.origin_mm + hull.voxel_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        int seen = 0;
        int background = 0;
        int specimen = 0;
        for (std::size_t i = 0; i < views.size(); ++i) {
          int px = 0;
          int py = 0;
          if (!locate(views[i], centre, evidence[i].width, evidence[i].height, px, py)) continue;
          ++seen;
          const MaskEvidence said = evidence[i].at(px, py);
          background += said == MaskEvidence::background ? 1 : 0;
          specimen += said == MaskEvidence::specimen ? 1 : 0;
        }
        const double needed = std::max<double>(options.least_votes, options.least_share * seen);
        if (specimen > 0 && 2 * seen > static_cast<int>(views.size()) && background < needed) {
          hull.inside[hull.index(x, y, z)] = 1;
        }
      }
    }
  });
  if (std::ranges::count(hull.inside, 1) < 20) {
    return fail(ErrorKind::no_result, "masks", "no specimen is seen that all views agree on",
                "give masks, or photograph it before a plain, dark backdrop");
  }
  return hull;
}

Image8 hull_silhouette(const VoteHull& hull, const MaskView& view) {
  const int width = view.lens.width / kMaskScale;
  const int height = view.lens.height / kMaskScale;
  Image8 silhouette(width, height, 1);
  const auto solid = [&](int x, int y, int z) {
    return x >= 0 && y >= 0 && z >= 0 && x < hull.side && y < hull.side && z < hull.side &&
           hull.inside[hull.index(x, y, z)] != 0;
  };
  for (int z = 0; z < hull.side; ++z) {
    for (int y = 0; y < hull.side; ++y) {
      for (int x = 0; x < hull.side; ++x) {
        if (!solid(x, y, z)) continue;
        if (solid(x - 1, y, z) && solid(x + 1, y, z) && solid(x, y - 1, z) && solid(x, y + 1, z) &&
            solid(x, y, z - 1) && solid(x, y, z + 1)) {
          continue;
        }
        const Eigen::Vector3d centre =
            hull.origin_mm + hull.voxel_mm * Eigen::Vector3d(x + 0.5, y + 0.5, z + 0.5);
        int px = 0;
        int py = 0;
        if (!locate(view, centre, width, height, px, py)) continue;
        const double depth = (view.camera_from_table * centre).z();
        const int reach =
            static_cast<int>(std::ceil(0.6 * hull.voxel_mm * view.lens.fx / depth / kMaskScale));
        for (int dy = std::max(0, py - reach); dy <= std::min(height - 1, py + reach); ++dy) {
          std::fill_n(silhouette.row(dy) + std::max(0, px - reach),
                      std::min(width - 1, px + reach) - std::max(0, px - reach) + 1,
                      std::uint8_t{255});
        }
      }
    }
  }
  return silhouette;
}

}  // namespace skullstation
