#pragma once

#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

enum class Alignment { none, rigid, similarity };

struct ComparisonOptions {
  Alignment align = Alignment::none;
  double samples_per_mm2 = 1.0;  ///< at least; see sample_surface
  double histogram_bin_mm = 0.1;
  double histogram_end_mm = 10.0;  ///< the last bin holds everything beyond
  /// Vertices of A that count (#V of A); empty: all. A triangle counts if all its corners do. The
  /// way back counts those samples of B whose closest point lies on a triangle that counts.
  std::vector<bool> region;
  int threads = 0;  ///< 0: all

  Result<void> validate() const;
};

/// Distances of one surface's area from the other surface, weighted by area.
struct DistanceStatistics {
  double area_mm2 = 0.0;  ///< the area that counts
  std::size_t samples = 0;
  double mean_mm = 0.0;
  double rms_mm = 0.0;
  double median_mm = 0.0;
  double p95_mm = 0.0;
  double max_mm = 0.0;            ///< over samples and vertices
  double signed_mean_mm = 0.0;    ///< positive: outside the other surface
  std::vector<double> histogram;  ///< share of the area in each bin, from 0 mm
};

struct Comparison {
  Similarity3 b_from_a;  ///< what A was moved by, identity without alignment
  DistanceStatistics a_to_b;
  DistanceStatistics b_to_a;
  double hausdorff_mm = 0.0;  ///< larger of the two maxima
  /// Signed distance of every vertex of A and B from the other surface [mm], positive outside;
  /// outside the region too.
  std::vector<double> vertex_distance_a_mm;
  std::vector<double> vertex_distance_b_mm;
};

/// Compares two surfaces by exact point-to-surface distances both ways, sampled by area (Aspert et
/// al. 2002), signed by pseudo-normals. A is aligned with B first if asked: align_by_trimmed_icp.
/// The same for any number of threads. Fails with `bad_input` for a mesh without area or a region
/// of another size or without area, `cancelled` on request.
Result<Comparison> compare_surfaces(const TriangleMesh& a, const TriangleMesh& b,
                                    const ComparisonOptions& options,
                                    const Progress& progress = {});

/// The mesh with its vertices coloured by signed distance: blue inside, white at 0, red outside,
/// full at `full_color_mm`; grey where `region` (empty: everywhere) doesn't count.
TriangleMesh colored_by_distance(TriangleMesh mesh, const std::vector<double>& distance_mm,
                                 double full_color_mm, const std::vector<bool>& region = {});

}  // namespace skullstation
