#pragma once

#include <string>
#include <vector>

#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/session_reconstruction.h"

namespace skullstation {

/// What a reconstruction is worth, in figures. Lengths in mm; medians and percentiles are over the
/// surface's vertices that two views or more see.
struct QualityFigures {
  int views = 0;
  int views_used = 0;
  double ground_sample_mm = 0.0;  ///< median size of a photograph's pixel on the specimen
  double accuracy_mm = 0.0;       ///< median estimated standard error along the normal
  double accuracy_p95_mm = 0.0;
  double seen_by_three_percent = 0.0;  ///< of the measured vertices
  double area_cm2 = 0.0;               ///< measured
  double filled_cm2 = 0.0;             ///< closed by a guess
  double open_edge_mm = 0.0;
};
QualityFigures quality_figures(const SessionReconstruction& reconstruction);

/// What a person should know: dropped views, a scale that rests on nothing, too little of the
/// specimen seen, a table that does not do what it is told; each with what to do about it. Empty if
/// all is well.
std::vector<std::string> quality_verdicts(const SessionReconstruction& reconstruction,
                                          const QualityFigures& figures);

/// The content of quality.json (format "skullstation-reconstruction-quality/1").
std::string quality_json(const SessionReconstruction& reconstruction);

/// The mesh coloured by how many views see each vertex: red for none or one, yellow for two,
/// green for three, to blue for eight and more.
TriangleMesh colored_by_coverage(TriangleMesh mesh, const std::vector<std::uint8_t>& views);

/// The mesh coloured by the estimated standard error of each vertex: blue for 0, through green at
/// 0.1 mm and yellow at 0.2 mm to red at 0.3 mm and more; grey where fewer than two views see it.
TriangleMesh colored_by_accuracy(TriangleMesh mesh, const std::vector<float>& accuracy_mm);

}  // namespace skullstation
