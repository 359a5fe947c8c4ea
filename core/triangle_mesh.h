#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>

namespace skullstation {

using Points3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;       // #V x 3, mm
using Triangles = Eigen::Matrix<int, Eigen::Dynamic, 3, Eigen::RowMajor>;        // #F x 3
using Colors = Eigen::Matrix<std::uint8_t, Eigen::Dynamic, 3, Eigen::RowMajor>;  // #V x 3, sRGB

/// Indexed triangles, counter-clockwise seen from outside.
struct TriangleMesh {
  Points3 vertices;
  Triangles triangles;
  Points3 normals;  ///< unit, per vertex; 0 rows if unknown
  Colors colors;    ///< per vertex; 0 rows if unknown
};

/// Axis-aligned box; empty (min > max) for no vertices.
Eigen::AlignedBox3d bounding_box(const TriangleMesh& mesh);

/// Area-weighted unit vertex normals (#V x 3); zero for a vertex without area.
Points3 vertex_normals(const TriangleMesh& mesh);

/// Surface area [mm^2].
double surface_area(const TriangleMesh& mesh);

/// Area around each vertex [mm^2], #V: a third of its triangles'.
Eigen::VectorXd vertex_areas(const TriangleMesh& mesh);

}  // namespace skullstation
