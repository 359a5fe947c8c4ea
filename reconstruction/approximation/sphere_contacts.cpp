#include "reconstruction/approximation/sphere_contacts.h"

#include <cmath>

namespace skullstation {

namespace {

/// Beyond this a vertex of the head does not belong to the bone below.
constexpr double kMostGap_mm = 25.0;
constexpr double kLeastCosine = 0.3;
constexpr int kCandidates = 150;

std::vector<Eigen::Index> known(const Eigen::VectorXd& radius_mm) {
  std::vector<Eigen::Index> spheres;
  for (Eigen::Index v = 0; v < radius_mm.size(); ++v) {
    if (!std::isnan(radius_mm[v])) spheres.push_back(v);
  }
  return spheres;
}

}  // namespace

SphereContacts::SphereContacts(const TriangleMesh& bone, const Eigen::VectorXd& radius_mm)
    : bone_(bone), spheres_(known(radius_mm)), tree_(bone.vertices(spheres_, Eigen::all)) {}

std::optional<SphereContact> SphereContacts::of(const Eigen::Vector3d& point,
                                                const Eigen::Vector3d& normal,
                                                const Eigen::VectorXd& radius_mm) const {
  SphereContact contact;
  contact.gap_mm = kMostGap_mm;
  bool found = false;
  for (const NearPoint& near : tree_.nearest(point, kCandidates)) {
    const Eigen::Index sphere = spheres_[static_cast<std::size_t>(near.index)];
    const double gap = std::sqrt(near.squared_distance) - radius_mm[sphere];
    if (gap >= contact.gap_mm) continue;
    contact.gap_mm = gap;
    contact.sphere = sphere;
    found = true;
  }
  if (!found) return std::nullopt;
  contact.way = (point - Eigen::Vector3d(bone_.vertices.row(contact.sphere))).normalized();
  if (contact.way.dot(normal) < kLeastCosine ||
      contact.way.dot(bone_.normals.row(contact.sphere)) < 0.0) {
    return std::nullopt;
  }
  return contact;
}

}  // namespace skullstation
