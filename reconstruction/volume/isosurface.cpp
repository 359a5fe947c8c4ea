#include "reconstruction/volume/isosurface.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/mesh/cube_cases.h"

namespace skullstation {

namespace {

constexpr std::int16_t outside_hu = std::numeric_limits<std::int16_t>::min();

/// One slice of the field with a border of outside all round, and what is known about its edges.
class Slice {
 public:
  Slice(int width, int height)
      : width_(width + 2),
        hu_(static_cast<std::size_t>(width + 2) * static_cast<std::size_t>(height + 2), outside_hu),
        above_(hu_.size(), 0) {
    for (auto& vertices : vertex_on_edge_) vertices.resize(hu_.size());
  }

  /// Takes slice `k` of the field; outside for a k beyond it.
  void load(const VoxelGrid& grid, std::span<const std::int16_t> values, int k, double iso_hu) {
    const bool inside = k >= 0 && k < grid.size.z();
    for (int j = 0; j < grid.size.y(); ++j) {
      std::int16_t* row = hu_.data() + index(0, j);
      if (inside) {
        std::memcpy(row, values.data() + grid.index(0, j, k),
                    static_cast<std::size_t>(grid.size.x()) * sizeof(std::int16_t));
      } else {
        std::fill_n(row, grid.size.x(), outside_hu);
      }
    }
    for (std::size_t i = 0; i < hu_.size(); ++i) above_[i] = hu_[i] >= iso_hu ? 1 : 0;
  }

  /// Place of (i, j), each from -1.
  std::size_t index(int i, int j) const {
    return static_cast<std::size_t>(j + 1) * static_cast<std::size_t>(width_) +
           static_cast<std::size_t>(i + 1);
  }
  std::int16_t hu(std::size_t at) const { return hu_[at]; }
  bool above(std::size_t at) const { return above_[at] != 0; }
  const std::uint8_t* above_row(std::size_t at) const { return above_.data() + at; }
  int& vertex(int axis, std::size_t at) {
    return vertex_on_edge_[static_cast<std::size_t>(axis)][at];
  }

 private:
  int width_;
  std::vector<std::int16_t> hu_;
  std::vector<std::uint8_t> above_;
  std::array<std::vector<int>, 3> vertex_on_edge_;  // set where the edge is crossed
};

/// Whether the `count` flags from `row` on all equal `flag`; eight at a time.
bool all_equal(const std::uint8_t* row, std::size_t count, std::uint8_t flag) {
  const std::uint64_t pattern = flag * 0x0101010101010101ULL;
  std::size_t i = 0;
  for (; i + 8 <= count; i += 8) {
    std::uint64_t eight = 0;
    std::memcpy(&eight, row + i, 8);
    if (eight != pattern) return false;
  }
  for (; i < count; ++i) {
    if (row[i] != flag) return false;
  }
  return true;
}

/// The cubes between slices [first, last) and the one above each. Vertices are numbered within the
/// slab; those on the x and y edges of slice `last` belong to the next slab, which numbers its
/// first slice's first, in the same order.
class Slab {
 public:
  Slab(const VoxelGrid& grid, std::span<const std::int16_t> values, double iso_hu)
      : grid_(grid), values_(values), iso_hu_(iso_hu) {}

  void run(int first, int last) {
    Slice below(grid_.size.x(), grid_.size.y());
    Slice above(grid_.size.x(), grid_.size.y());
    below.load(grid_, values_, first, iso_hu_);
    number_in_slice(below, first);
    for (int k = first; k < last; ++k) {
      above.load(grid_, values_, k + 1, iso_hu_);
      number_between(below, above, k);
      if (k + 1 < last) {
        number_in_slice(above, k + 1);
      } else {
        number_in_next_slab(above);
      }
      make_triangles(below, above);
      std::swap(below, above);
    }
  }

  std::vector<Eigen::Vector3f> voxel_positions;  // relative to the slab's own numbering
  /// Corners of triangles: own vertices from 0, the next slab's as -1 - number.
  std::vector<int> corners;

 private:
  static constexpr int row_block = 32;

  void add_vertex(int i, int j, int k, int axis, std::int16_t from, std::int16_t to) {
    // Not at the very ends, so that no two vertices share a place.
    const double t = std::clamp((iso_hu_ - from) / (to - from), 1e-3, 1.0 - 1e-3);
    Eigen::Vector3f position(static_cast<float>(i), static_cast<float>(j), static_cast<float>(k));
    position[axis] += static_cast<float>(t);
    voxel_positions.push_back(position);
  }

  /// Calls `found(i, j, at, axis, other)` for each x and y edge of the slice that is crossed.
  template <class Found>
  void for_edges_in_slice(const Slice& slice, const Found& found) const {
    const int width = grid_.size.x();
    const std::size_t right = 1;
    const std::size_t up = slice.index(0, 1) - slice.index(0, 0);
    for (int j = -1; j <= grid_.size.y(); ++j) {
      for (int i = -1; i <= width; i += row_block) {
        const int end = std::min(width + 1, i + row_block);
        const std::size_t begin = slice.index(i, j);
        const auto count = static_cast<std::size_t>(end - i) + (end <= width ? 1U : 0U);
        const bool has_row_above = j < grid_.size.y();
        const std::uint8_t flag = *slice.above_row(begin);
        if (all_equal(slice.above_row(begin), count, flag) &&
            (!has_row_above || all_equal(slice.above_row(begin + up), count, flag))) {
          continue;
        }
        for (int x = i; x < end; ++x) {
          const std::size_t at = slice.index(x, j);
          if (x < width && slice.above(at) != slice.above(at + right)) {
            found(x, j, at, 0, at + right);
          }
          if (has_row_above && slice.above(at) != slice.above(at + up)) {
            found(x, j, at, 1, at + up);
          }
        }
      }
    }
  }

  void number_in_slice(Slice& slice, int k) {
    for_edges_in_slice(slice, [&](int i, int j, std::size_t at, int axis, std::size_t other) {
      slice.vertex(axis, at) = static_cast<int>(voxel_positions.size());
      add_vertex(i, j, k, axis, slice.hu(at), slice.hu(other));
    });
  }

  void number_in_next_slab(Slice& slice) const {
    int number = 0;
    for_edges_in_slice(slice, [&](int, int, std::size_t at, int axis, std::size_t) {
      slice.vertex(axis, at) = -1 - number++;
    });
  }

  void number_between(Slice& below, const Slice& above, int k) {
    for (int j = -1; j <= grid_.size.y(); ++j) {
      for (int i = -1; i <= grid_.size.x(); ++i) {
        const std::size_t at = below.index(i, j);
        if (below.above(at) == above.above(at)) continue;
        below.vertex(2, at) = static_cast<int>(voxel_positions.size());
        add_vertex(i, j, k, 2, below.hu(at), above.hu(at));
      }
    }
  }

  void make_triangles(Slice& below, Slice& above) {
    const CubeCases& cases = cube_cases(DiagonalCorners::are_joined);
    const std::size_t up = below.index(0, 1) - below.index(0, 0);
    const int width = grid_.size.x();
    for (int j = -1; j < grid_.size.y(); ++j) {
      for (int i = -1; i < width; i += row_block) {
        const int end = std::min(width, i + row_block);
        const std::size_t begin = below.index(i, j);
        const auto count = static_cast<std::size_t>(end - i) + 1U;
        const std::uint8_t flag = *below.above_row(begin);
        if (all_equal(below.above_row(begin), count, flag) &&
            all_equal(below.above_row(begin + up), count, flag) &&
            all_equal(above.above_row(begin), count, flag) &&
            all_equal(above.above_row(begin + up), count, flag)) {
          continue;
        }
        for (int x = i; x < end; ++x) {
          const std::size_t at = below.index(x, j);
          const unsigned corner_set =
              unsigned{below.above(at)} | unsigned{below.above(at + 1)} << 1 |
              unsigned{below.above(at + up)} << 2 | unsigned{below.above(at + up + 1)} << 3 |
              unsigned{above.above(at)} << 4 | unsigned{above.above(at + 1)} << 5 |
              unsigned{above.above(at + up)} << 6 | unsigned{above.above(at + up + 1)} << 7;
          for (const std::array<int, 3>& triangle : cases[corner_set]) {
            for (const int edge : triangle) {
              const CubeEdge& e = cube_edges[static_cast<std::size_t>(edge)];
              Slice& slice = (e.corner & 4) != 0 ? above : below;
              const std::size_t shift = static_cast<std::size_t>(e.corner & 1) +
                                        ((e.corner & 2) != 0 ? up : std::size_t{0});
              corners.push_back(slice.vertex(e.axis, at + shift));
            }
          }
        }
      }
    }
  }

  const VoxelGrid& grid_;
  std::span<const std::int16_t> values_;
  double iso_hu_;
};

/// Numbers the slabs' vertices through and carries them over to the patient.
TriangleMesh joined(const VoxelGrid& grid, std::vector<Slab>& slabs) {
  std::vector<int> first_vertex{0};
  std::vector<Eigen::Index> first_corner{0};
  for (const Slab& slab : slabs) {
    first_vertex.push_back(first_vertex.back() + static_cast<int>(slab.voxel_positions.size()));
    first_corner.push_back(first_corner.back() + std::ssize(slab.corners));
  }
  TriangleMesh mesh;
  mesh.vertices.resize(first_vertex.back(), 3);
  mesh.triangles.resize(first_corner.back() / 3, 3);
  const bool left_handed = grid.direction.determinant() < 0.0;
  for (std::size_t s = 0; s < slabs.size(); ++s) {
    Slab& slab = slabs[s];
    for (std::size_t v = 0; v < slab.voxel_positions.size(); ++v) {
      mesh.vertices.row(first_vertex[s] + static_cast<Eigen::Index>(v)) =
          grid.patient_from_voxel(slab.voxel_positions[v].cast<double>()).transpose();
    }
    int* corner = mesh.triangles.data() + first_corner[s];
    for (const int number : slab.corners) {
      *corner++ = number >= 0 ? first_vertex[s] + number : first_vertex[s + 1] - 1 - number;
    }
    slab.voxel_positions = {};
    slab.corners = {};
  }
  if (left_handed) mesh.triangles.col(1).swap(mesh.triangles.col(2));
  return mesh;
}

}  // namespace

TriangleMesh isosurface(const VoxelGrid& grid, std::span<const std::int16_t> values, double iso_hu,
                        int threads) {
  // Thin slabs: the same number of them for any number of threads.
  constexpr int slab_slices = 16;
  const int cube_layers = grid.size.z() + 1;  // from slice -1 on
  const int count = (cube_layers + slab_slices - 1) / slab_slices;
  std::vector<Slab> slabs(static_cast<std::size_t>(count), Slab(grid, values, iso_hu));
  parallel_for(count, threads, [&](int s) {
    const int first = -1 + s * slab_slices;
    slabs[static_cast<std::size_t>(s)].run(first, std::min(first + slab_slices, grid.size.z()));
  });
  return joined(grid, slabs);
}

}  // namespace skullstation
