#include "reconstruction/approximation/face_error.h"

#include <algorithm>
#include <vector>

#include "core/parallel.h"
#include "reconstruction/distance/triangle_bvh.h"

namespace skullstation {

FaceError face_error(const HeadTemplate& head_template, const Points3& head,
                     const Eigen::VectorXd& band_mm, const TriangleMesh& true_skin, int threads) {
  const TriangleBvh skin(true_skin);
  std::vector<double> distances(static_cast<std::size_t>(head.rows()));
  parallel_for(static_cast<int>(head.rows()), threads, [&](int v) {
    distances[static_cast<std::size_t>(v)] = skin.closest(Eigen::Vector3d(head.row(v))).distance_mm;
  });

  FaceError error;
  std::vector<double> of_face;
  int over_bone = 0;
  for (Eigen::Index v = 0; v < head.rows(); ++v) {
    const double distance = distances[static_cast<std::size_t>(v)];
    switch (head_template.region[static_cast<std::size_t>(v)]) {
      case HeadRegion::face:
        ++over_bone;
        error.over_bone_mean_mm += distance;
        [[fallthrough]];
      case HeadRegion::nose:
      case HeadRegion::lips:
      case HeadRegion::eyes:
        of_face.push_back(distance);
        error.mean_mm += distance;
        error.within_band += distance <= band_mm[v] ? 1.0 : 0.0;
        break;
      default: break;
    }
  }
  error.vertices = static_cast<int>(of_face.size());
  if (of_face.empty()) return error;
  const auto count = static_cast<double>(of_face.size());
  error.mean_mm /= count;
  error.within_band /= count;
  error.features_mean_mm = (error.mean_mm * count - error.over_bone_mean_mm) /
                           std::max(1.0, count - static_cast<double>(over_bone));
  error.over_bone_mean_mm /= std::max(1, over_bone);
  const auto p95 = of_face.begin() + static_cast<std::ptrdiff_t>(0.95 * (count - 1.0));
  std::ranges::nth_element(of_face, p95);
  error.p95_mm = *p95;
  return error;
}

}  // namespace skullstation
