#include "reconstruction/phantom/tissue_sites.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace skullstation {

using Eigen::MatrixXd;
using Eigen::Vector3d;

namespace {

constexpr double kDeepest_mm = 28.0;
constexpr double kEarRadius_mm = 36.0;
/// Nearer to bone than this the skin is steered at more places.
constexpr double kThin_mm = 9.0;
constexpr double kThinSpacing_mm = 11.0;
constexpr double kThickSpacing_mm = 18.0;

double gaussian(const Vector3d& a, const Vector3d& b, double range_mm) {
  return std::exp(-0.5 * (a - b).squaredNorm() / (range_mm * range_mm));
}

/// Covariance of two logarithms of thickness ratios: of fat people all tissue is thicker.
double covariance(const Vector3d& a, const Vector3d& b) {
  return 0.25 + 0.06 * gaussian(a, b, 60.0) + 0.06 * gaussian(a, b, 25.0);
}

}  // namespace

CanonicalBone::CanonicalBone(const SkullMeshes& skull)
    : cranium_(skull.cranium), mandible_(skull.mandible) {}

NearestBone CanonicalBone::nearest(const Vector3d& query, const Rigid3& open_from_closed,
                                   double max_distance_mm) const {
  NearestBone nearest;
  const ClosestPoint cranium = cranium_.closest(query, max_distance_mm);
  if (cranium.triangle >= 0) nearest = {cranium.point, cranium.distance_mm, false};
  const ClosestPoint mandible = mandible_.closest(open_from_closed.inverse() * query,
                                                  std::min(max_distance_mm, nearest.distance_mm));
  if (mandible.triangle >= 0) {
    nearest = {open_from_closed * mandible.point, mandible.distance_mm, true};
  }
  return nearest;
}

std::vector<TissueSite> tissue_sites(const TriangleMesh& skin, const CanonicalBone& bone,
                                     const Vector3d& left_ear) {
  std::vector<TissueSite> sites;
  for (Eigen::Index v = 0; v < skin.vertices.rows(); ++v) {
    TissueSite site;
    site.skin = skin.vertices.row(v);
    const Vector3d on_left(std::abs(site.skin.x()), site.skin.y(), site.skin.z());
    const bool by_ear = (on_left - left_ear).norm() < kEarRadius_mm;
    const NearestBone nearest = bone.nearest(site.skin, {}, by_ear ? kThin_mm : kDeepest_mm);
    if (!std::isfinite(nearest.distance_mm)) continue;
    site.bone = nearest.point;
    site.depth_mm = nearest.distance_mm;
    site.on_mandible = nearest.on_mandible;
    site.on_vault = site.skin.z() > 65.0 || (site.skin.y() > 40.0 && site.skin.z() > 10.0);
    const double spacing_mm = site.depth_mm < kThin_mm ? kThinSpacing_mm : kThickSpacing_mm;
    const auto near = [&](const TissueSite& other) {
      return (site.skin - other.skin).norm() < spacing_mm;
    };
    if (std::ranges::none_of(sites, near)) sites.push_back(site);
  }
  return sites;
}

MatrixXd log_ratio_kriging(std::span<const Vector3d> known, std::span<const Vector3d> sites) {
  constexpr double kNoise = 0.02;
  const auto count = static_cast<Eigen::Index>(known.size());
  MatrixXd between(count, count);
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b < count; ++b) between(a, b) = covariance(known[a], known[b]);
    between(a, a) += kNoise * kNoise;
  }
  MatrixXd across(count, static_cast<Eigen::Index>(sites.size()));
  for (Eigen::Index s = 0; s < across.cols(); ++s) {
    for (Eigen::Index a = 0; a < count; ++a) across(a, s) = covariance(known[a], sites[s]);
  }
  return between.llt().solve(across).transpose();
}

Clearance clearance(const CanonicalBone& bone, const Rigid3& open_from_closed,
                    const Vector3d& start, const Vector3d& end) {
  constexpr double kTouch_mm = 0.2;
  const double way_mm = (end - start).norm();
  double gone_mm = 0.0;
  // No bone lies nearer than the distance at a point: so far one may go on.
  while (true) {
    const Vector3d here = way_mm > 0.0 ? start + gone_mm / way_mm * (end - start) : end;
    const NearestBone nearest = bone.nearest(here, open_from_closed);
    if (gone_mm >= way_mm) return {nearest.distance_mm, nearest.point};
    if (nearest.distance_mm < kTouch_mm) return {gone_mm - way_mm, nearest.point};
    gone_mm = std::min(way_mm, gone_mm + nearest.distance_mm);
  }
}

}  // namespace skullstation
