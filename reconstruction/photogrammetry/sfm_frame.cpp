#include "reconstruction/photogrammetry/sfm_frame.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "core/linear_algebra.h"
#include "core/median.h"

namespace skullstation {

namespace {

/// The rotation that lies nearest to all others in total.
Eigen::Quaterniond medoid(const std::vector<Eigen::Quaterniond>& rotations) {
  double least = std::numeric_limits<double>::infinity();
  Eigen::Quaterniond best = rotations.front();
  for (const Eigen::Quaterniond& candidate : rotations) {
    double sum = 0.0;
    for (const Eigen::Quaterniond& other : rotations) sum += candidate.angularDistance(other);
    if (sum < least) {
      least = sum;
      best = candidate;
    }
  }
  return best;
}

/// Mean of those within twice the median distance of the medoid (Markley et al. 2007).
Eigen::Quaterniond robust_mean(const std::vector<Eigen::Quaterniond>& rotations) {
  const Eigen::Quaterniond middle = medoid(rotations);
  std::vector<double> distances;
  for (const Eigen::Quaterniond& q : rotations) distances.push_back(middle.angularDistance(q));
  const double limit = std::max(2.0 * median(distances), 1e-9);
  Eigen::Matrix4d sum = Eigen::Matrix4d::Zero();
  for (std::size_t i = 0; i < rotations.size(); ++i) {
    if (distances[i] <= limit) sum += rotations[i].coeffs() * rotations[i].coeffs().transpose();
  }
  const SymmetricSpectrum solver = symmetric_spectrum(sum);
  return Eigen::Quaterniond(Eigen::Vector4d(solver.vectors.col(3))).normalized();
}

/// The point nearest to all cameras' lines of sight.
Eigen::Vector3d looked_at(const std::vector<Rigid3>& cameras) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const Rigid3& camera : cameras) {
    const Rigid3 back = camera.inverse();
    const Eigen::Vector3d direction = back.rotation * Eigen::Vector3d::UnitZ();
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - direction * direction.transpose();
    normal += across;
    right += across * back.translation;
  }
  return least_squares(normal, right);
}

}  // namespace

std::optional<FrameFit> fit_frame(const std::vector<FramePair>& views) {
  if (views.size() < 3) return std::nullopt;
  std::vector<Eigen::Quaterniond> rotations;
  std::vector<Eigen::Vector3d> in_ref;
  std::vector<Eigen::Vector3d> in_model;
  for (const FramePair& view : views) {
    rotations.push_back(view.camera_from_reference.rotation.conjugate() *
                        view.camera_from_model.rotation);
    in_ref.push_back(view.camera_from_reference.inverse().translation);
    in_model.push_back(view.camera_from_model.inverse().translation);
  }
  FrameFit fit;
  Similarity3& frame = fit.reference_from_model;
  frame.rotation = robust_mean(rotations);
  std::vector<double> ratios;
  for (std::size_t i = 0; i < views.size(); ++i) {
    for (std::size_t j = i + 1; j < views.size(); ++j) {
      const double base = (in_model[i] - in_model[j]).norm();
      if (base > 0.0) ratios.push_back((in_ref[i] - in_ref[j]).norm() / base);
    }
  }
  if (ratios.empty()) return std::nullopt;
  frame.scale = median(ratios);
  if (!(frame.scale > 0.0) || !std::isfinite(frame.scale)) return std::nullopt;
  std::vector<double> deviations;
  for (const double ratio : ratios) deviations.push_back(std::abs(ratio / frame.scale - 1.0));
  // Pairs are not independent: as many as there are views count.
  fit.scale_error_percent =
      100.0 * 1.4826 * median(deviations) / std::sqrt(static_cast<double>(views.size()));
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> shifts;
    for (std::size_t i = 0; i < views.size(); ++i) {
      shifts.push_back(in_ref[i][axis] - (frame.scale * (frame.rotation * in_model[i]))[axis]);
    }
    frame.translation[axis] = median(std::move(shifts));
  }
  return fit;
}

Rigid3 in_reference(const Rigid3& camera_from_model, const Similarity3& reference_from_model) {
  // A camera's frame keeps its directions and takes on the reference's unit.
  const Eigen::Quaterniond rotation =
      (camera_from_model.rotation * reference_from_model.rotation.conjugate()).normalized();
  const Eigen::Vector3d centre = reference_from_model * camera_from_model.inverse().translation;
  return {rotation, -(rotation * centre)};
}

Similarity3 frame_of_cameras(const std::vector<Rigid3>& camera_from_model, double distance) {
  const Eigen::Vector3d target = looked_at(camera_from_model);
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  double sum = 0.0;
  for (const Rigid3& camera : camera_from_model) {
    up -= camera.rotation.conjugate() * Eigen::Vector3d::UnitY();
    sum += (camera.inverse().translation - target).norm();
  }
  Similarity3 frame;
  frame.scale = distance * static_cast<double>(camera_from_model.size()) / sum;
  frame.rotation = shortest_rotation(up, Eigen::Vector3d::UnitZ());
  frame.translation = -frame.scale * (frame.rotation * target);
  return frame;
}

}  // namespace skullstation
