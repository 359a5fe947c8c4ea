#include "reconstruction/distance/surface_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace skullstation {

namespace {

constexpr double most_samples = 1e8;

struct Corners {
  Eigen::Vector3d a, b, c;

  double area_mm2() const { return 0.5 * (b - a).cross(c - a).norm(); }
  double longest_side_mm() const {
    return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
  }
};

Corners corners_of(const TriangleMesh& mesh, Eigen::Index triangle) {
  return {mesh.vertices.row(mesh.triangles(triangle, 0)),
          mesh.vertices.row(mesh.triangles(triangle, 1)),
          mesh.vertices.row(mesh.triangles(triangle, 2))};
}

/// Into how many parts each side is cut; a double, since it may be absurd.
double cuts(const Corners& corners, double samples_per_mm2) {
  const double by_area = std::ceil(std::sqrt(corners.area_mm2() * samples_per_mm2));
  const double by_side = std::ceil(corners.longest_side_mm() * std::sqrt(samples_per_mm2) / 3.0);
  return std::max({1.0, by_area, by_side});
}

}  // namespace

Result<std::vector<SurfaceSample>> sample_surface(const TriangleMesh& mesh,
                                                  double samples_per_mm2) {
  double total = 0.0;
  for (Eigen::Index f = 0; f < mesh.triangles.rows(); ++f) {
    const double k = cuts(corners_of(mesh, f), samples_per_mm2);
    total += k * k;
  }
  if (!(total <= most_samples)) {
    return fail(ErrorKind::bad_input, "mesh",
                fmt::format("{:.3g} samples would be needed to cover its {:.3g} mm^2", total,
                            surface_area(mesh)),
                "check that the mesh is in millimetres");
  }
  std::vector<SurfaceSample> samples;
  samples.reserve(static_cast<std::size_t>(total));
  for (int f = 0; f < mesh.triangles.rows(); ++f) {
    const Corners corners = corners_of(mesh, f);
    const double area_mm2 = corners.area_mm2();
    if (!(area_mm2 > 0.0)) continue;
    const int k = static_cast<int>(cuts(corners, samples_per_mm2));
    const Eigen::Vector3d u = (corners.b - corners.a) / k;
    const Eigen::Vector3d v = (corners.c - corners.a) / k;
    for (int i = 0; i < k; ++i) {
      for (int j = 0; i + j < k; ++j) {
        const Eigen::Vector3d corner = corners.a + i * u + j * v;
        samples.push_back({corner + (u + v) / 3.0, area_mm2 / k / k, f});
        if (i + j + 1 < k) samples.push_back({corner + 2.0 * (u + v) / 3.0, area_mm2 / k / k, f});
      }
    }
  }
  return samples;
}

}  // namespace skullstation
