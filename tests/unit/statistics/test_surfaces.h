#pragma once

#include <cmath>
#include <numbers>

#include "core/triangle_mesh.h"

namespace skullstation::testing {

/// A sphere round the origin of rings and spokes, closed, with normals.
inline TriangleMesh sphere(double radius_mm, int rings = 24, int spokes = 48) {
  TriangleMesh mesh;
  const int inner = (rings - 1) * spokes;
  mesh.vertices.resize(inner + 2, 3);
  for (int r = 1; r < rings; ++r) {
    const double polar = std::numbers::pi * r / rings;
    for (int s = 0; s < spokes; ++s) {
      const double turn = 2.0 * std::numbers::pi * s / spokes;
      mesh.vertices.row((r - 1) * spokes + s) << std::sin(polar) * std::cos(turn),
          std::sin(polar) * std::sin(turn), std::cos(polar);
    }
  }
  mesh.vertices.row(inner) << 0.0, 0.0, 1.0;
  mesh.vertices.row(inner + 1) << 0.0, 0.0, -1.0;
  mesh.normals = mesh.vertices;
  mesh.vertices *= radius_mm;
  mesh.triangles.resize(2 * inner, 3);
  int t = 0;
  for (int s = 0; s < spokes; ++s) {
    const int next = (s + 1) % spokes;
    mesh.triangles.row(t++) << inner, s, next;
    for (int r = 1; r + 1 < rings; ++r) {
      const int a = (r - 1) * spokes;
      const int b = r * spokes;
      mesh.triangles.row(t++) << a + s, b + s, b + next;
      mesh.triangles.row(t++) << a + s, b + next, a + next;
    }
    mesh.triangles.row(t++) << inner + 1, (rings - 2) * spokes + next, (rings - 2) * spokes + s;
  }
  return mesh;
}

}  // namespace skullstation::testing
