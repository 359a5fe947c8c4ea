#include "reconstruction/volume/slice_picture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace skullstation {

namespace {

constexpr double line_radius_px = 0.7;

/// How a picture's pixels lie on the slice's voxels.
struct Layout {
  int across = 0;  // voxel axis that runs to the right
  int down = 1;    // voxel axis that runs down, or up if `flipped`
  bool flipped = false;
  Eigen::Vector2d voxels_per_pixel;
  Eigen::Vector2i voxels;  // of the slice along both axes
  Eigen::Vector2i pixels;

  Eigen::Vector2d pixel_of(const Eigen::Vector3d& voxel) const {
    const double y = flipped ? voxels.y() - 1.0 - voxel[down] : voxel[down];
    return Eigen::Vector2d(voxel[across] + 0.5, y + 0.5).cwiseQuotient(voxels_per_pixel);
  }
};

Layout layout_of(const VoxelGrid& grid, int axis, double pixel_mm) {
  Layout layout;
  layout.across = axis == 0 ? 1 : 0;
  layout.down = axis == 2 ? 1 : 2;
  layout.flipped = axis != 2;
  const Eigen::Vector2d spacing_mm(grid.spacing_mm[layout.across], grid.spacing_mm[layout.down]);
  layout.voxels = {grid.size[layout.across], grid.size[layout.down]};
  layout.voxels_per_pixel = spacing_mm.cwiseInverse() * pixel_mm;
  layout.pixels = layout.voxels.cast<double>()
                      .cwiseQuotient(layout.voxels_per_pixel)
                      .array()
                      .ceil()
                      .cast<int>()
                      .max(1);
  return layout;
}

double value_at(const Volume& volume, const SlicePlane& plane, const Layout& layout,
                const Eigen::Vector2d& place) {
  const Eigen::Vector2i last = layout.voxels - Eigen::Vector2i::Ones();
  const Eigen::Vector2d inside = place.cwiseMax(0.0).cwiseMin(last.cast<double>());
  const Eigen::Vector2i low = inside.cast<int>();
  const Eigen::Vector2d t = inside - low.cast<double>();
  double value = 0.0;
  for (int n = 0; n < 4; ++n) {
    const Eigen::Vector2i corner = (low + Eigen::Vector2i(n & 1, n >> 1)).cwiseMin(last);
    Eigen::Vector3i voxel;
    voxel[plane.axis] = plane.index;
    voxel[layout.across] = corner.x();
    voxel[layout.down] = corner.y();
    value += ((n & 1) != 0 ? t.x() : 1.0 - t.x()) * ((n >> 1) != 0 ? t.y() : 1.0 - t.y()) *
             volume.at(voxel.x(), voxel.y(), voxel.z());
  }
  return value;
}

/// Raises the coverage of the pixels near the segment.
void draw_segment(const Eigen::Vector2d& from, const Eigen::Vector2d& to, ImageF& coverage) {
  const Eigen::Vector2d along = to - from;
  const double length2 = std::max(along.squaredNorm(), 1e-12);
  const double reach = line_radius_px + 0.5;
  const Eigen::Vector2d low = from.cwiseMin(to).array() - reach;
  const Eigen::Vector2d high = from.cwiseMax(to).array() + reach;
  for (int y = std::max(0, static_cast<int>(low.y()));
       y <= std::min(coverage.height - 1, static_cast<int>(high.y())); ++y) {
    for (int x = std::max(0, static_cast<int>(low.x()));
         x <= std::min(coverage.width - 1, static_cast<int>(high.x())); ++x) {
      const Eigen::Vector2d middle(x + 0.5, y + 0.5);
      const double t = std::clamp((middle - from).dot(along) / length2, 0.0, 1.0);
      const double distance = (middle - from - t * along).norm();
      const double covered = std::clamp(reach - distance, 0.0, 1.0);
      coverage.at(x, y) = std::max(coverage.at(x, y), static_cast<float>(covered));
    }
  }
}

/// The mesh's section with the slice.
ImageF section_of(const TriangleMesh& mesh, const VoxelGrid& grid, const SlicePlane& plane,
                  const Layout& layout) {
  ImageF coverage(layout.pixels.x(), layout.pixels.y(), 1);
  // A hair beside the voxels' middles, where caps and vertices lie.
  const double height = plane.index + 1e-3;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    std::array<Eigen::Vector3d, 3> corner;
    for (int c = 0; c < 3; ++c) {
      corner[static_cast<std::size_t>(c)] =
          grid.voxel_from_patient(mesh.vertices.row(mesh.triangles(f, c)).transpose());
    }
    std::array<Eigen::Vector2d, 2> crossing;
    std::size_t crossings = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const Eigen::Vector3d& a = corner[c];
      const Eigen::Vector3d& b = corner[(c + 1) % 3];
      if ((a[plane.axis] < height) == (b[plane.axis] < height)) continue;
      const double t = (height - a[plane.axis]) / (b[plane.axis] - a[plane.axis]);
      crossing[crossings++] = layout.pixel_of(a + t * (b - a));
    }
    if (crossings == 2) draw_segment(crossing[0], crossing[1], coverage);
  }
  return coverage;
}

}  // namespace

Image8 slice_picture(const Volume& volume, const SlicePlane& plane,
                     std::span<const SliceOutline> outlines, const SlicePictureOptions& options) {
  const Layout layout = layout_of(volume.grid, plane.axis, options.pixel_mm);
  Image8 picture(layout.pixels.x(), layout.pixels.y(), 3);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      Eigen::Vector2d place =
          Eigen::Vector2d(x + 0.5, y + 0.5).cwiseProduct(layout.voxels_per_pixel);
      place.array() -= 0.5;
      if (layout.flipped) place.y() = layout.voxels.y() - 1.0 - place.y();
      const double hu = value_at(volume, plane, layout, place);
      const double grey =
          std::clamp((hu - options.black_hu) / (options.white_hu - options.black_hu), 0.0, 1.0);
      for (int c = 0; c < 3; ++c) {
        picture.at(x, y, c) = static_cast<std::uint8_t>(std::lround(255.0 * grey));
      }
    }
  }
  for (const SliceOutline& outline : outlines) {
    const ImageF coverage = section_of(*outline.mesh, volume.grid, plane, layout);
    for (int y = 0; y < picture.height; ++y) {
      for (int x = 0; x < picture.width; ++x) {
        const double share = coverage.at(x, y);
        for (int c = 0; c < 3; ++c) {
          const double mixed =
              (1.0 - share) * picture.at(x, y, c) + share * 255.0 * outline.color[c];
          picture.at(x, y, c) = static_cast<std::uint8_t>(std::lround(mixed));
        }
      }
    }
  }
  return picture;
}

}  // namespace skullstation
