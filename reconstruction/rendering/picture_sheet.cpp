#include "reconstruction/rendering/picture_sheet.h"

#include <algorithm>
#include <array>

namespace skullstation {

std::span<const PictureSide> head_sides() {
  using Eigen::Vector3d;
  static const std::array<PictureSide, 8> sides = {{
      {"front", Vector3d(0, -1, 0), Vector3d::UnitZ()},
      {"left three-quarter", Vector3d(0.7, -0.7, 0.1), Vector3d::UnitZ()},
      {"left", Vector3d(1, 0, 0), Vector3d::UnitZ()},
      {"back", Vector3d(0, 1, 0), Vector3d::UnitZ()},
      {"right three-quarter", Vector3d(-0.7, -0.7, 0.1), Vector3d::UnitZ()},
      {"right", Vector3d(-1, 0, 0), Vector3d::UnitZ()},
      {"top", Vector3d(0, 0, 1), Vector3d(0, -1, 0)},
      {"base", Vector3d(0, 0, -1), Vector3d(0, -1, 0)},
  }};
  return sides;
}

Image8 picture_sheet(std::span<const Image8> pictures, int columns) {
  if (pictures.empty()) return {};
  const Image8& first = pictures.front();
  const int count = static_cast<int>(pictures.size());
  const int rows = (count + columns - 1) / columns;
  Image8 sheet(first.width * std::min(count, columns), first.height * rows, first.channels, 255);
  for (int i = 0; i < count; ++i) {
    const Image8& picture = pictures[static_cast<std::size_t>(i)];
    const int left = (i % columns) * first.width;
    const int top = (i / columns) * first.height;
    for (int y = 0; y < picture.height; ++y) {
      std::copy_n(picture.row(y), picture.width * picture.channels,
                  sheet.row(top + y) + left * sheet.channels);
    }
  }
  return sheet;
}

Result<std::vector<Image8>> render_sides(std::span<const PicturedMesh> meshes,
                                         std::span<const PictureSide> sides,
                                         const PictureOptions& options) {
  if (Result<void> valid = options.validate(); !valid) return forward(valid);
  std::vector<const TriangleMesh*> seen;
  for (const PicturedMesh& pictured : meshes) seen.push_back(pictured.mesh);
  const double aspect = static_cast<double>(options.width) / options.height;

  std::vector<PictureCamera> cameras;
  double height_mm = 0.0;
  for (const PictureSide& side : sides) {
    cameras.push_back(look_at(seen, side.from, side.up, aspect));
    height_mm = std::max(height_mm, cameras.back().height_mm);
  }
  std::vector<Image8> pictures;
  for (PictureCamera& camera : cameras) {
    camera.height_mm = height_mm;
    Result<Image8> picture = render_picture(meshes, camera, options);
    if (!picture) return forward(picture);
    pictures.push_back(*std::move(picture));
  }
  return pictures;
}

}  // namespace skullstation
