#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/sights.h"

namespace skullstation {

/// A connected part of a surface, laid flat as one view sees it: since all of its triangles are
/// visible from there, they don't cover each other.
struct TextureChart {
  int view = 0;
  std::vector<int> triangles;
  std::vector<std::array<Eigen::Vector2f, 3>> corners;  ///< of each triangle, in the view's pixels
  Eigen::Vector2f low{0.0f, 0.0f};                      ///< bounding box of the corners
  Eigen::Vector2f high{0.0f, 0.0f};
};

/// Cuts a surface into charts: each triangle goes to a view that sees it frontally, as its
/// neighbours do (energy of Lempitsky & Ivanov 2007, lowered triangle by triangle). Triangles that
/// no view sees belong to none.
/// \pre the mesh has normals
std::vector<TextureChart> cut_charts(const TriangleMesh& mesh, const Sights& sights, int threads);

/// A rectangle's place in an atlas [px].
struct AtlasPlace {
  int x = 0;
  int y = 0;
};

/// Packs rectangles (width, height) into a square of `side` pixels, bottom-left against the
/// skyline, the highest first (Jylänki 2010). Empty if they don't fit.
std::vector<AtlasPlace> pack_rectangles(const std::vector<Eigen::Vector2i>& sizes, int side);

}  // namespace skullstation
