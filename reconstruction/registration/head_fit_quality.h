#pragma once

#include "reconstruction/registration/head_registration.h"
#include "reconstruction/registration/oriented_points.h"

namespace skullstation {

/// Points of the scan with how far each is believed.
struct ScanPoints {
  OrientedPoints points;
  Eigen::VectorXd weight;
};

/// Fills `observed`, `distance_mm` and `quality` of a fit whose vertices lie at `vertices`: over
/// the points of the scan that the sheet does not end before.
void measure_head_fit(const HeadTemplate& head, const Points3& vertices, const TriangleMesh& scan,
                      const ScanPoints& points, int threads, FittedHead& fitted);

}  // namespace skullstation
