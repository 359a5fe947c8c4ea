#include "reconstruction/phantom/isosurface.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <memory>
#include <tuple>
#include <utility>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/mesh/cube_cases.h"

namespace skullstation {

namespace {

/// Cells along a block's edge. A block owns the grid points at its lower faces, not at its upper
/// ones, and the edges and cells that start at its points.
constexpr int kBlockShift = 2;
constexpr int kBlock = 1 << kBlockShift;
constexpr int kPoints = kBlock * kBlock * kBlock;

int local_index(const Eigen::Vector3i& in_block) {
  return (in_block.z() * kBlock + in_block.y()) * kBlock + in_block.x();
}

Eigen::Vector3i local_point(int index) {
  return {index % kBlock, index / kBlock % kBlock, index / (kBlock * kBlock)};
}

/// The part of the grid that holds one stretch of surface.
struct Block {
  Eigen::Vector3i first;                   ///< grid index of its lower corner
  std::unique_ptr<ImplicitSolid> solid;    ///< good for the block and a cell around it
  std::array<float, kPoints> distance_mm;  ///< at its grid points
  std::array<int, 3 * kPoints> vertex;     ///< on the edge along each axis of each point, or -1
  int first_vertex = 0;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<std::array<int, 3>> triangles;
};

class SparseGrid {
 public:
  SparseGrid(const ImplicitSolid& solid, const IsosurfaceOptions& options)
      : solid_(solid), options_(options) {
    const double block_mm = kBlock * options.cell_mm;
    const Eigen::AlignedBox3d box = solid.bounds();
    // A block more on every side, so that each cell at the surface has all its neighbours.
    first_block_ = (box.min() / block_mm).array().floor().matrix().cast<int>();
    first_block_ -= Eigen::Vector3i::Ones();
    counts_ = (box.max() / block_mm).array().floor().matrix().cast<int>() - first_block_ +
              Eigen::Vector3i::Constant(2);
    blocks_.resize(static_cast<std::size_t>(counts_.prod()));
  }

  TriangleMesh extract() {
    for_each_slot([&](int slot) { sample(slot); });
    for_each_active([&](Block& block) { place_vertices(block); });
    number_vertices();
    for_each_active([&](Block& block) { connect(block); });
    TriangleMesh mesh = joined();
    relax(mesh);
    return mesh;
  }

 private:
  template <class Work>
  void for_each_slot(const Work& work) {
    parallel_for(static_cast<int>(blocks_.size()), options_.threads, work);
  }

  template <class Work>
  void for_each_active(const Work& work) {
    for_each_slot([&](int slot) {
      if (blocks_[slot]) work(*blocks_[slot]);
    });
  }

  Eigen::Vector3d position_mm(const Eigen::Vector3i& grid_point) const {
    return options_.cell_mm * grid_point.cast<double>();
  }

  const Block* block_of(const Eigen::Vector3i& grid_point) const {
    // A shift rounds towards minus infinity.
    const Eigen::Vector3i at =
        grid_point.unaryExpr([](int i) { return i >> kBlockShift; }) - first_block_;
    if (at.minCoeff() < 0 || (at.array() >= counts_.array()).any()) return nullptr;
    const int slot = (at.z() * counts_.y() + at.y()) * counts_.x() + at.x();
    return blocks_[static_cast<std::size_t>(slot)].get();
  }

  void sample(int slot) {
    const Eigen::Vector3i at(slot % counts_.x(), slot / counts_.x() % counts_.y(),
                             slot / (counts_.x() * counts_.y()));
    const Eigen::Vector3i first = (at + first_block_) * kBlock;
    const Eigen::Vector3d center =
        position_mm(first) + Eigen::Vector3d::Constant(0.5 * kBlock * options_.cell_mm);
    // Half the diagonal of the block grown by a cell on every side.
    const double reach_mm = 0.5 * (kBlock + 2) * std::sqrt(3.0) * options_.cell_mm;
    if (std::abs(solid_.distance_mm(center)) > reach_mm) return;

    auto block = std::make_unique<Block>();
    block->first = first;
    block->solid = solid_.near_ball(center, reach_mm, 2.0 * options_.cell_mm);
    for (int row = 0; row < kPoints; row += kBlock) {
      for (int x = 0; x < kBlock;) {
        const double distance =
            block->solid->distance_mm(position_mm(first + local_point(row + x)));
        // Distances grow by at most about 1.5 mm per mm: the sign holds for some points to come.
        const int same = static_cast<int>(std::abs(distance) / (1.5 * options_.cell_mm));
        const int end = std::min(kBlock, x + std::max(1, same));
        while (x < end) block->distance_mm[row + x++] = static_cast<float>(distance);
      }
    }
    blocks_[slot] = std::move(block);
  }

  void place_vertices(Block& block) const {
    block.vertex.fill(-1);
    for (int i = 0; i < kPoints; ++i) {
      const double here = block.distance_mm[i];
      const Eigen::Vector3i point = block.first + local_point(i);
      for (int axis = 0; axis < 3; ++axis) {
        const Eigen::Vector3i other = point + Eigen::Vector3i::Unit(axis);
        const Block* owner = block_of(other);
        if (owner == nullptr) continue;
        const double there = owner->distance_mm[local_index(other - owner->first)];
        if ((here < 0.0) == (there < 0.0)) continue;
        // Away from the ends, lest several vertices meet in a grid point.
        const double along = std::clamp(here / (here - there), 0.02, 0.98);
        block.vertex[3 * i + axis] = static_cast<int>(block.vertices.size());
        block.vertices.push_back(position_mm(point) +
                                 along * options_.cell_mm * Eigen::Vector3d::Unit(axis));
      }
    }
  }

  void number_vertices() {
    int count = 0;
    for (const std::unique_ptr<Block>& block : blocks_) {
      if (!block) continue;
      block->first_vertex = count;
      count += static_cast<int>(block->vertices.size());
    }
  }

  void connect(Block& block) const {
    for (int i = 0; i < kPoints; ++i) {
      const Eigen::Vector3i cell = block.first + local_point(i);
      const auto corner_point = [&](int corner) {
        return Eigen::Vector3i(cell + Eigen::Vector3i(corner & 1, corner >> 1 & 1, corner >> 2));
      };
      int inside = 0;
      bool complete = true;
      for (int corner = 0; corner < 8 && complete; ++corner) {
        const Eigen::Vector3i point = corner_point(corner);
        const Block* owner = block_of(point);
        complete = owner != nullptr;
        if (complete && owner->distance_mm[local_index(point - owner->first)] < 0.0F) {
          inside |= 1 << corner;
        }
      }
      if (!complete) continue;
      for (const std::array<int, 3>& cut : cube_cases(DiagonalCorners::stay_apart)[inside]) {
        std::array<int, 3> triangle;
        for (int k = 0; k < 3; ++k) {
          const Eigen::Vector3i start = corner_point(cube_edges[cut[k]].corner);
          const Block* owner = block_of(start);
          const int axis = cut[k] / 4;
          triangle[k] =
              owner->first_vertex + owner->vertex[3 * local_index(start - owner->first) + axis];
        }
        block.triangles.push_back(triangle);
      }
    }
  }

  TriangleMesh joined() const {
    std::size_t vertex_count = 0;
    std::size_t triangle_count = 0;
    for (const std::unique_ptr<Block>& block : blocks_) {
      if (!block) continue;
      vertex_count += block->vertices.size();
      triangle_count += block->triangles.size();
    }
    TriangleMesh mesh;
    mesh.vertices.resize(static_cast<Eigen::Index>(vertex_count), 3);
    mesh.normals = Points3::Zero(static_cast<Eigen::Index>(vertex_count), 3);
    mesh.triangles.resize(static_cast<Eigen::Index>(triangle_count), 3);
    Eigen::Index v = 0;
    Eigen::Index f = 0;
    for (const std::unique_ptr<Block>& block : blocks_) {
      if (!block) continue;
      for (const Eigen::Vector3d& vertex : block->vertices) mesh.vertices.row(v++) = vertex;
      for (const std::array<int, 3>& triangle : block->triangles) {
        mesh.triangles.row(f++) << triangle[0], triangle[1], triangle[2];
      }
    }
    return mesh;
  }

  /// Newton steps onto the surface, each after a tangential step towards the mean of the
  /// neighbours; and the normals.
  void relax(TriangleMesh& mesh) {
    // Each side of the closed surface is met once in each direction: every neighbour counts once.
    const Eigen::Index count = mesh.vertices.rows();
    std::vector<int> first_neighbour(static_cast<std::size_t>(count) + 1, 0);
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      for (int k = 0; k < 3; ++k) ++first_neighbour[mesh.triangles(f, k) + 1];
    }
    for (Eigen::Index v = 0; v < count; ++v) first_neighbour[v + 1] += first_neighbour[v];
    std::vector<int> neighbours(static_cast<std::size_t>(first_neighbour.back()));
    std::vector<int> fill(first_neighbour.begin(), first_neighbour.end() - 1);
    for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
      for (int k = 0; k < 3; ++k) {
        neighbours[fill[mesh.triangles(f, k)]++] = mesh.triangles(f, (k + 1) % 3);
      }
    }

    Points3 before;
    for (int step = 0; step <= options_.relaxation_steps; ++step) {
      before = mesh.vertices;
      for_each_active([&](Block& block) {
        for (int i = 0; i < static_cast<int>(block.vertices.size()); ++i) {
          const int v = block.first_vertex + i;
          Eigen::Vector3d p = before.row(v);
          if (step > 0) {
            Eigen::Vector3d mean = Eigen::Vector3d::Zero();
            for (int n = first_neighbour[v]; n < first_neighbour[v + 1]; ++n) {
              mean += before.row(neighbours[n]).transpose();
            }
            mean /= first_neighbour[v + 1] - first_neighbour[v];
            const Eigen::Vector3d normal = mesh.normals.row(v);
            const Eigen::Vector3d pull = mean - p;
            p += 0.5 * (pull - normal * normal.dot(pull));
          }
          // Between the first step and the last the normals of the first will do.
          double distance = 0.0;
          Eigen::Vector3d gradient = mesh.normals.row(v);
          if (step == 0 || step == options_.relaxation_steps) {
            std::tie(distance, gradient) = first_order(*block.solid, p);
          } else {
            distance = block.solid->distance_mm(p);
          }
          const double slope_squared = std::max(gradient.squaredNorm(), 0.25);
          const Eigen::Vector3d newton = -distance / slope_squared * gradient;
          const double limit = 0.5 * options_.cell_mm;
          p += newton * std::min(1.0, limit / std::max(newton.norm(), 1e-12));
          mesh.vertices.row(v) = p;
          const double slope = gradient.norm();
          if (slope > 0.0) mesh.normals.row(v) = gradient / slope;
        }
      });
    }
  }

  /// Distance and gradient from the four corners of a small tetrahedron.
  static std::pair<double, Eigen::Vector3d> first_order(const ImplicitSolid& solid,
                                                        const Eigen::Vector3d& point) {
    constexpr double kStep_mm = 0.02;
    static const std::array<Eigen::Vector3d, 4> kCorners = {
        Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(1, -1, -1), Eigen::Vector3d(-1, 1, -1),
        Eigen::Vector3d(-1, -1, 1)};
    double sum = 0.0;
    Eigen::Vector3d gradient = Eigen::Vector3d::Zero();
    for (const Eigen::Vector3d& corner : kCorners) {
      const double distance = solid.distance_mm(point + kStep_mm * corner);
      sum += distance;
      gradient += distance * corner;
    }
    return {sum / 4.0, gradient / (4.0 * kStep_mm)};
  }

  const ImplicitSolid& solid_;
  IsosurfaceOptions options_;
  Eigen::Vector3i first_block_;
  Eigen::Vector3i counts_;
  std::vector<std::unique_ptr<Block>> blocks_;
};

}  // namespace

TriangleMesh isosurface(const ImplicitSolid& solid, const IsosurfaceOptions& options) {
  assert(options.cell_mm >= 0.2 && options.cell_mm <= 20.0 && options.relaxation_steps >= 0);
  return SparseGrid(solid, options).extract();
}

}  // namespace skullstation
