#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/sights.h"

namespace skullstation {

/// The photographs that colour a vertex, the better the more: near ones, frontal ones, sharp ones.
struct ColorMix {
  static constexpr int kMost = 4;
  std::array<std::int16_t, kMost> view{-1, -1, -1, -1};  ///< -1: no more
  std::array<float, kMost> weight{};                     ///< sum 1, or 0 for an unseen vertex
};

/// Colours of a surface blended from photographs whose exposures were made equal (gains of Brown &
/// Lowe 2007, in linear light). A view that is out of tune with the others (a highlight, something
/// before the surface) hardly counts.
class SurfaceColors {
 public:
  /// \pre the mesh has normals and outlives this, as do the sights
  SurfaceColors(const TriangleMesh& mesh, const Sights& sights, int threads);

  /// One for each vertex; the least of a vertex's weights is near 0, so that colours don't jump
  /// where views come and go.
  const std::vector<ColorMix>& mixes() const { return mixes_; }

  /// Linear RGB of a point by the mixes of its triangle's corners; false if no view colours it.
  bool light_at(const Eigen::Vector3d& point, std::span<const int, 3> corners,
                const Eigen::Vector3f& barycentric, Eigen::Vector3f& light) const;

  /// sRGB of all vertices; mid grey where no view sees them.
  Colors vertex_colors(int threads) const;

 private:
  Eigen::Vector3f equalised(int view, const Eigen::Vector3d& point) const;

  const TriangleMesh& mesh_;
  std::span<const StereoView> views_;
  std::vector<float> gains_;
  std::vector<ColorMix> mixes_;
};

}  // namespace skullstation
