#include "reconstruction/photogrammetry/surface_extraction.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/parallel.h"
#include "reconstruction/mesh/cube_cases.h"

namespace skullstation {

namespace {

constexpr int kSide = kFusionBlock + 1;  // with the first points of the next blocks

/// A block's grid points and the neighbours' that its cells need.
struct Cells {
  std::array<float, kSide * kSide * kSide> distance;
  std::array<float, kSide * kSide * kSide> weight;

  static int at(int x, int y, int z) { return (z * kSide + y) * kSide + x; }
};

struct Piece {
  std::array<int, 3 * kFusionPoints> vertex;  ///< on the edge along each axis of each point, or -1
  std::vector<Eigen::Vector3f> vertices;
  std::vector<float> weights;
  std::vector<std::array<int, 3>> triangles;
  int first_vertex = 0;
};

int local(int x, int y, int z) { return (z * kFusionBlock + y) * kFusionBlock + x; }

class Extractor {
 public:
  Extractor(const FusionVolume& volume, double least_weight, int threads)
      : volume_(volume),
        least_weight_(static_cast<float>(least_weight)),
        threads_(threads),
        pieces_(volume.blocks.size()) {}

  FusedSurface extract() {
    const auto count = static_cast<int>(volume_.blocks.size());
    neighbours_.resize(volume_.blocks.size());
    parallel_for(count, threads_, [&](int b) { place_vertices(b); });
    int vertices = 0;
    for (Piece& piece : pieces_) {
      piece.first_vertex = vertices;
      vertices += static_cast<int>(piece.vertices.size());
    }
    parallel_for(count, threads_, [&](int b) { connect(b); });
    return joined(vertices);
  }

 private:
  void find_neighbours(int b) {
    for (int n = 0; n < 8; ++n) {
      const Eigen::Vector3i step(n & 1, n >> 1 & 1, n >> 2);
      neighbours_[b][n] = n == 0 ? b : volume_.find(volume_.blocks[b].at + step);
    }
  }

  Cells gather(int b) const {
    Cells cells;
    cells.weight.fill(0.0f);
    cells.distance.fill(1.0f);
    for (int z = 0; z < kSide; ++z) {
      for (int y = 0; y < kSide; ++y) {
        for (int x = 0; x < kSide; ++x) {
          const int n = (x == kFusionBlock ? 1 : 0) | (y == kFusionBlock ? 2 : 0) |
                        (z == kFusionBlock ? 4 : 0);
          const int owner = neighbours_[b][n];
          if (owner < 0) continue;
          const int i = local(x % kFusionBlock, y % kFusionBlock, z % kFusionBlock);
          cells.distance[Cells::at(x, y, z)] = volume_.blocks[owner].distance_mm[i];
          cells.weight[Cells::at(x, y, z)] = volume_.blocks[owner].weight[i];
        }
      }
    }
    return cells;
  }

  void place_vertices(int b) {
    find_neighbours(b);
    const Cells cells = gather(b);
    Piece& piece = pieces_[b];
    piece.vertex.fill(-1);
    const Eigen::Vector3i first = volume_.blocks[b].at * kFusionBlock;
    const auto voxel = static_cast<float>(volume_.voxel_mm);
    for (int z = 0; z < kFusionBlock; ++z) {
      for (int y = 0; y < kFusionBlock; ++y) {
        for (int x = 0; x < kFusionBlock; ++x) {
          const int here = Cells::at(x, y, z);
          for (int axis = 0; axis < 3; ++axis) {
            const int there = Cells::at(x + (axis == 0), y + (axis == 1), z + (axis == 2));
            const float a = cells.distance[here];
            const float c = cells.distance[there];
            if (!seen(cells, here) || !seen(cells, there) || (a < 0.0f) == (c < 0.0f)) continue;
            // Away from the ends, lest several vertices meet in a grid point.
            const float along = std::clamp(a / (a - c), 0.02f, 0.98f);
            piece.vertex[3 * local(x, y, z) + axis] = static_cast<int>(piece.vertices.size());
            Eigen::Vector3f p = (first + Eigen::Vector3i(x, y, z)).cast<float>();
            p[axis] += along;
            piece.vertices.push_back(p * voxel);
            piece.weights.push_back(std::min(cells.weight[here], cells.weight[there]));
          }
        }
      }
    }
  }

  bool seen(const Cells& cells, int i) const { return cells.weight[i] >= least_weight_; }

  void connect(int b) {
    const Cells cells = gather(b);
    Piece& piece = pieces_[b];
    for (int z = 0; z < kFusionBlock; ++z) {
      for (int y = 0; y < kFusionBlock; ++y) {
        for (int x = 0; x < kFusionBlock; ++x) {
          int inside = 0;
          bool complete = true;
          for (int corner = 0; corner < 8 && complete; ++corner) {
            const int i = Cells::at(x + (corner & 1), y + (corner >> 1 & 1), z + (corner >> 2));
            complete = seen(cells, i);
            if (cells.distance[i] < 0.0f) inside |= 1 << corner;
          }
          if (!complete || inside == 0 || inside == 255) continue;
          for (const std::array<int, 3>& cut : cube_cases(DiagonalCorners::stay_apart)[inside]) {
            piece.triangles.push_back({vertex_on(b, x, y, z, cut[0]), vertex_on(b, x, y, z, cut[1]),
                                       vertex_on(b, x, y, z, cut[2])});
          }
        }
      }
    }
  }

  /// The vertex on an edge of the cell at (x, y, z).
  int vertex_on(int b, int x, int y, int z, int edge) const {
    const int corner = cube_edges[edge].corner;
    const int u = x + (corner & 1);
    const int v = y + (corner >> 1 & 1);
    const int w = z + (corner >> 2);
    const int n =
        (u == kFusionBlock ? 1 : 0) | (v == kFusionBlock ? 2 : 0) | (w == kFusionBlock ? 4 : 0);
    const Piece& owner = pieces_[neighbours_[b][n]];
    const int i = local(u % kFusionBlock, v % kFusionBlock, w % kFusionBlock);
    return owner.first_vertex + owner.vertex[3 * i + edge / 4];
  }

  /// Without the vertices that no triangle needs.
  FusedSurface joined(int vertices) const {
    std::vector<int> number(vertices, -1);
    Eigen::Index triangles = 0;
    for (const Piece& piece : pieces_) {
      triangles += static_cast<Eigen::Index>(piece.triangles.size());
      for (const auto& triangle : piece.triangles) {
        for (const int v : triangle) number[v] = 0;
      }
    }
    int used = 0;
    for (int& v : number) v = v == 0 ? used++ : -1;
    FusedSurface surface;
    surface.mesh.vertices.resize(used, 3);
    surface.mesh.triangles.resize(triangles, 3);
    surface.weight.resize(used);
    Eigen::Index f = 0;
    for (const Piece& piece : pieces_) {
      for (std::size_t i = 0; i < piece.vertices.size(); ++i) {
        const int v = number[piece.first_vertex + static_cast<int>(i)];
        if (v < 0) continue;
        surface.mesh.vertices.row(v) = piece.vertices[i].cast<double>().transpose();
        surface.weight[v] = piece.weights[i];
      }
      for (const auto& t : piece.triangles) {
        surface.mesh.triangles.row(f++) << number[t[0]], number[t[1]], number[t[2]];
      }
    }
    surface.mesh.normals = vertex_normals(surface.mesh);
    return surface;
  }

  const FusionVolume& volume_;
  const float least_weight_;
  const int threads_;
  std::vector<Piece> pieces_;
  std::vector<std::array<int, 8>> neighbours_;  ///< blocks at +0 or +1 on each axis, or -1
};

}  // namespace

FusedSurface extract_surface(const FusionVolume& volume, double least_weight, int threads) {
  return Extractor(volume, least_weight, threads).extract();
}

}  // namespace skullstation
