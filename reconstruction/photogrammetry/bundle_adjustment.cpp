#include "reconstruction/photogrammetry/bundle_adjustment.h"

#include <ceres/ceres.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <map>

#include "core/adjustment/bundle_solver.h"
#include "core/adjustment/reprojection.h"
#include "core/units.h"

namespace skullstation {

namespace {

template <class T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

/// Of a known point.
struct CornerResidual {
  Eigen::Vector3d x_board;
  Eigen::Vector2d observed_px;
  double sd_px;

  template <class T>
  bool operator()(const T* intrinsics, const T* rotation, const T* translation, T* residual) const {
    const Vector3<T> x = transformed<T>(rotation, translation, x_board.cast<T>());
    const Eigen::Matrix<T, 2, 1> px = project_opencv<T>(intrinsics, x);
    residual[0] = (px.x() - observed_px.x()) / sd_px;
    residual[1] = (px.y() - observed_px.y()) / sd_px;
    return true;
  }
};

/// Of a point that is itself unknown.
struct SightResidual {
  Eigen::Vector2d observed_px;
  double sd_px;

  template <class T>
  bool operator()(const T* intrinsics, const T* rotation, const T* translation, const T* point,
                  T* residual) const {
    const Eigen::Map<const Vector3<T>> x(point);
    const Eigen::Matrix<T, 2, 1> px =
        project_opencv<T>(intrinsics, transformed<T>(rotation, translation, x));
    residual[0] = (px.x() - observed_px.x()) / sd_px;
    residual[1] = (px.y() - observed_px.y()) / sd_px;
    return true;
  }
};

/// What is known about a lens beforehand. An exact number has its standard deviation at 1 here
/// and is held constant by a manifold.
struct LensPrior {
  std::array<double, 8> known;
  std::array<double, 8> sd;
  double aspect_sd;

  template <class T>
  bool operator()(const T* intrinsics, T* residual) const {
    for (std::size_t i = 0; i < 8; ++i) residual[i] = (intrinsics[i] - known[i]) / sd[i];
    residual[8] = (intrinsics[0] / intrinsics[1] - known[0] / known[1]) / aspect_sd;
    return true;
  }
};

/// Displacement of the reach points between a view's own pose and where its ring has it.
struct RingResidual {
  std::array<Eigen::Vector3d, 4> points;
  double sd_mm;

  template <class T>
  bool operator()(const T* axis, const T* angle_rad, const T* ring_rotation,
                  const T* ring_translation, const T* rotation, const T* translation,
                  T* residual) const {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Vector3<T> x = points[i].cast<T>();
      const Vector3<T> by_ring = transformed<T>(
          ring_rotation, ring_translation, turned<T>(*angle_rad, board_point_on_table<T>(axis, x)));
      Eigen::Map<Vector3<T>>(residual + 3 * i) =
          (transformed<T>(rotation, translation, x) - by_ring) / T(sd_mm);
    }
    return true;
  }
};

/// Displacement of the reach points from where they were.
struct PlaceResidual {
  std::array<Eigen::Vector3d, 4> points;
  Rigid3 place;
  double sd_mm;

  template <class T>
  bool operator()(const T* rotation, const T* translation, T* residual) const {
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d before = place * points[i];
      Eigen::Map<Vector3<T>>(residual + 3 * i) =
          (transformed<T>(rotation, translation, points[i].cast<T>()) - before.cast<T>()) /
          T(sd_mm);
    }
    return true;
  }
};

struct AngleResidual {
  double commanded_rad;
  double sd_rad;

  template <class T>
  bool operator()(const T* angle_rad, T* residual) const {
    residual[0] = (*angle_rad - commanded_rad) / sd_rad;
    return true;
  }
};

std::array<double, 8> numbers_of(const Lens& lens) {
  return {lens.fx, lens.fy, lens.cx, lens.cy, lens.k1, lens.k2, lens.p1, lens.p2};
}

/// Four points of three coordinates measure six unknowns: their residuals weigh as if they were
/// six measurements of the standard deviation given.
const double ring_weight = std::sqrt(0.5);

/// The problem as Ceres holds it. The unknowns live in this object: lenses are copied back by
/// finish().
class CeresBundle {
 public:
  explicit CeresBundle(BundleProblem& problem) : problem_(problem) {
    for (const BundleLens& lens : problem.lenses) intrinsics_.push_back(numbers_of(lens.lens));
  }

  void add_corners(const CharucoBoard& board) {
    for (BundleView& view : problem_.views) {
      double* const lens = intrinsics_[static_cast<std::size_t>(view.lens)].data();
      for (const BoardCorner& corner : view.corners) {
        ceres_.AddResidualBlock(
            new ceres::AutoDiffCostFunction<CornerResidual, 2, 8, 4, 3>(new CornerResidual{
                board.corner(corner.id), corner.position_px, problem_.corner_sd_px}),
            new ceres::HuberLoss(problem_.huber_sds), lens, rotation(view.camera_from_board),
            translation(view.camera_from_board));
      }
    }
    for (std::size_t i = 0; i < intrinsics_.size(); ++i) add_lens_prior(i);
    for (BundleView& view : problem_.views) make_rotation(view.camera_from_board);
  }

  void add_sights() {
    for (BundleView& view : problem_.views) {
      double* const lens = intrinsics_[static_cast<std::size_t>(view.lens)].data();
      for (const BundleSight& sight : view.sights) {
        ceres_.AddResidualBlock(new ceres::AutoDiffCostFunction<SightResidual, 2, 8, 4, 3, 3>(
                                    new SightResidual{sight.position_px, problem_.sight_sd_px}),
                                new ceres::HuberLoss(problem_.huber_sds), lens,
                                rotation(view.camera_from_board),
                                translation(view.camera_from_board),
                                problem_.points[static_cast<std::size_t>(sight.point)].data());
      }
      if (!view.sights.empty()) {
        ceres_.SetParameterBlockConstant(lens);
        make_rotation(view.camera_from_board);
      }
    }
  }

  /// \pre trust.departure_mm > 0
  template <class Loss>
  void add_rings(const TableTrust& trust, double loss_sds) {
    for (BundleView& view : problem_.views) {
      if (view.ring < 0) continue;
      BundleRing& ring = problem_.rings[static_cast<std::size_t>(view.ring)];
      TableAxis& axis = problem_.axes[static_cast<std::size_t>(ring.axis)];
      ceres_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<RingResidual, 12, 4, 1, 4, 3, 4, 3>(
              new RingResidual{reach_points(trust.reach_mm), trust.departure_mm / ring_weight}),
          new Loss(loss_sds), axis.unknowns.data(), &view.angle_rad,
          rotation(ring.camera_from_station), translation(ring.camera_from_station),
          rotation(view.camera_from_board), translation(view.camera_from_board));
      ceres_.AddResidualBlock(
          new ceres::AutoDiffCostFunction<AngleResidual, 1, 1>(
              new AngleResidual{view.commanded_rad, radians(trust.angle_sd_deg)}),
          new Loss(loss_sds), &view.angle_rad);
    }
    for (const BundleView& view : problem_.views) {
      if (view.ring < 0) continue;
      make_rotation(problem_.rings[static_cast<std::size_t>(view.ring)].camera_from_station);
    }
  }

  void hold_views() {
    for (BundleView& view : problem_.views) {
      if (view.ring < 0) continue;
      make_rotation(view.camera_from_board);
      ceres_.SetParameterBlockConstant(rotation(view.camera_from_board));
      ceres_.SetParameterBlockConstant(translation(view.camera_from_board));
    }
  }

  /// What no photograph tells (place, direction and unit of the whole) stays about as it is: the
  /// axes do, and the first ring's camera hangs on a soft spring.
  void hold_frame(double reach_mm) {
    constexpr double spring_mm = 1.0;
    for (TableAxis& axis : problem_.axes) ceres_.SetParameterBlockConstant(axis.unknowns.data());
    Rigid3& ring = problem_.rings.front().camera_from_station;
    ceres_.AddResidualBlock(new ceres::AutoDiffCostFunction<PlaceResidual, 12, 4, 3>(
                                new PlaceResidual{reach_points(reach_mm), ring, spring_mm}),
                            nullptr, rotation(ring), translation(ring));
  }

  bool solve(BundleShape shape = BundleShape::many_views) { return solve_bundle(ceres_, shape); }

  void finish() {
    for (std::size_t i = 0; i < intrinsics_.size(); ++i) {
      BundleLens& lens = problem_.lenses[i];
      lens.lens = Lens::from_params(lens.lens.width, lens.lens.height, LensModel::opencv,
                                    {intrinsics_[i].begin(), intrinsics_[i].end()});
    }
  }

  std::optional<BundleCovariance> covariance();
  std::vector<Eigen::Matrix<double, 6, 6>> covariance_by_points(double reach_mm);

 private:
  static double* rotation(Rigid3& pose) { return pose.rotation.coeffs().data(); }
  static double* translation(Rigid3& pose) { return pose.translation.data(); }

  void make_rotation(Rigid3& pose) {
    ceres_.SetManifold(rotation(pose), new ceres::EigenQuaternionManifold);
  }

  void add_lens_prior(std::size_t index) {
    double* const block = intrinsics_[index].data();
    if (!ceres_.HasParameterBlock(block)) return;
    const BundleLens& lens = problem_.lenses[index];
    LensPrior prior{numbers_of(lens.known), lens.sd, lens.aspect_sd};
    std::vector<int> exact;
    for (int i = 0; i < 8; ++i) {
      double& sd = prior.sd[static_cast<std::size_t>(i)];
      if (sd > 0.0) continue;
      exact.push_back(i);
      sd = 1.0;
    }
    if (exact.size() == 8) return ceres_.SetParameterBlockConstant(block);
    if (!exact.empty()) ceres_.SetManifold(block, new ceres::SubsetManifold(8, exact));
    ceres_.AddResidualBlock(new ceres::AutoDiffCostFunction<LensPrior, 9, 8>(new LensPrior(prior)),
                            nullptr, block);
  }

  BundleProblem& problem_;
  std::vector<std::array<double, 8>> intrinsics_;
  ceres::Problem ceres_;
};

std::optional<BundleCovariance> CeresBundle::covariance() {
  std::vector<double*> blocks;
  std::map<const double*, int> column;
  int columns = 0;
  const auto add = [&](double* block) {
    if (!ceres_.HasParameterBlock(block) || ceres_.IsParameterBlockConstant(block) ||
        column.contains(block)) {
      return;
    }
    blocks.push_back(block);
    column[block] = columns;
    columns += ceres_.ParameterBlockTangentSize(block);
  };
  for (auto& lens : intrinsics_) add(lens.data());
  for (BundleView& view : problem_.views) {
    add(rotation(view.camera_from_board));
    add(translation(view.camera_from_board));
    add(&view.angle_rad);
  }
  for (BundleRing& ring : problem_.rings) {
    add(rotation(ring.camera_from_station));
    add(translation(ring.camera_from_station));
  }
  for (TableAxis& axis : problem_.axes) add(axis.unknowns.data());
  const Eigen::MatrixXd inverse = bundle_covariance(ceres_, blocks, -1, true);
  if (inverse.size() == 0) return std::nullopt;

  BundleCovariance result;
  Eigen::VectorXd by_unknown = Eigen::VectorXd::Zero(columns);
  double distance = 0.0;
  for (BundleView& view : problem_.views) {
    const int turn = column.at(rotation(view.camera_from_board));
    const int shift = column.at(translation(view.camera_from_board));
    Eigen::Matrix<double, 6, 6> motion;
    motion << inverse.block<3, 3>(turn, turn), inverse.block<3, 3>(turn, shift),
        inverse.block<3, 3>(shift, turn), inverse.block<3, 3>(shift, shift);
    // Ceres's tangent of a quaternion is half the rotation vector.
    motion.topRows<3>() *= 2.0;
    motion.leftCols<3>() *= 2.0;
    result.views.push_back(motion);
    // |camera - board| = |translation|, the board frame's origin being its middle.
    const Eigen::Vector3d& t = view.camera_from_board.translation;
    distance += t.norm();
    by_unknown.segment<3>(shift) += t.normalized();
  }
  result.scale_sd = std::sqrt(by_unknown.dot(inverse * by_unknown)) / distance;
  for (auto& lens : intrinsics_) {
    std::array<double, 8>& sd = result.lens_sd.emplace_back();
    if (!column.contains(lens.data())) continue;
    const BundleLens& about = problem_.lenses[result.lens_sd.size() - 1];
    int at = column.at(lens.data());
    for (std::size_t i = 0; i < 8; ++i) {
      if (about.sd[i] > 0.0) {
        sd[i] = std::sqrt(inverse(at, at));
        ++at;
      }
    }
  }
  return result;
}

/// The columns of a row of the Jacobian are those of one view, then those of one point.
std::vector<Eigen::Matrix<double, 6, 6>> CeresBundle::covariance_by_points(double reach_mm) {
  ceres::Problem::EvaluateOptions options;
  for (BundleView& view : problem_.views) {
    if (view.sights.empty()) return {};
    options.parameter_blocks.push_back(rotation(view.camera_from_board));
    options.parameter_blocks.push_back(translation(view.camera_from_board));
  }
  for (Eigen::Vector3d& point : problem_.points) {
    if (!ceres_.HasParameterBlock(point.data())) return {};
    options.parameter_blocks.push_back(point.data());
  }
  ceres::CRSMatrix jacobian;
  if (!ceres_.Evaluate(options, nullptr, nullptr, nullptr, &jacobian)) return {};

  using PointRow = Eigen::RowVector3d;
  using ViewRow = Eigen::Matrix<double, 1, 6>;
  const auto views = static_cast<Eigen::Index>(problem_.views.size());
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(6 * views, 6 * views);
  std::vector<Eigen::Matrix3d> of_point(problem_.points.size(), Eigen::Matrix3d::Zero());
  std::vector<std::map<int, Eigen::Matrix<double, 6, 3>>> shared(problem_.points.size());
  for (int row = 0; row < jacobian.num_rows; ++row) {
    const auto begin = static_cast<std::size_t>(jacobian.rows[static_cast<std::size_t>(row)]);
    const int first = jacobian.cols[begin];
    const auto point = static_cast<std::size_t>((jacobian.cols[begin + 6] - 6 * views) / 3);
    // Ceres's tangent of a quaternion is half the rotation vector; in units of length it weighs
    // as much as the shift.
    ViewRow by_view = Eigen::Map<const ViewRow>(jacobian.values.data() + begin);
    by_view.head<3>() /= 2.0 * reach_mm;
    const PointRow by_point = Eigen::Map<const PointRow>(jacobian.values.data() + begin + 6);
    normal.block<6, 6>(first, first) += by_view.transpose() * by_view;
    of_point[point] += by_point.transpose() * by_point;
    const auto [entry, added] =
        shared[point].try_emplace(first, Eigen::Matrix<double, 6, 3>::Zero());
    entry->second += by_view.transpose() * by_point;
  }
  for (std::size_t point = 0; point < shared.size(); ++point) {
    const Eigen::Matrix3d inverse = of_point[point].inverse();
    if (!inverse.allFinite()) return {};
    for (const auto& [i, of_i] : shared[point]) {
      const Eigen::Matrix<double, 6, 3> weighted = of_i * inverse;
      for (const auto& [j, of_j] : shared[point]) {
        normal.block<6, 6>(i, j) -= weighted * of_j.transpose();
      }
    }
  }
  constexpr Eigen::Index untold = 7;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(normal);
  if (eigen.info() != Eigen::Success || normal.rows() <= untold) return {};
  const Eigen::VectorXd told = eigen.eigenvalues().tail(normal.rows() - untold);
  if (!(told.minCoeff() > 0.0)) return {};
  const Eigen::MatrixXd directions = eigen.eigenvectors().rightCols(told.size());
  const Eigen::MatrixXd inverse =
      directions * told.cwiseInverse().asDiagonal() * directions.transpose();
  std::vector<Eigen::Matrix<double, 6, 6>> result;
  for (Eigen::Index view = 0; view < views; ++view) {
    Eigen::Matrix<double, 6, 6> motion = inverse.block<6, 6>(6 * view, 6 * view);
    motion.topRows<3>() /= reach_mm;
    motion.leftCols<3>() /= reach_mm;
    result.push_back(motion);
  }
  return result;
}

}  // namespace

std::array<Eigen::Vector3d, 4> reach_points(double reach_mm) {
  // A tetrahedron about the middle of a specimen that stands on the board.
  const double a = reach_mm / std::sqrt(3.0);
  const Eigen::Vector3d middle(0.0, 0.0, a);
  return {middle + Eigen::Vector3d(a, a, a), middle + Eigen::Vector3d(-a, -a, a),
          middle + Eigen::Vector3d(-a, a, -a), middle + Eigen::Vector3d(a, -a, -a)};
}

double ring_departure_mm(const BundleProblem& problem, const BundleView& view, double reach_mm) {
  const BundleRing& ring = problem.rings[static_cast<std::size_t>(view.ring)];
  const TableAxis& axis = problem.axes[static_cast<std::size_t>(ring.axis)];
  const Rigid3 by_ring = ring.camera_from_station * rotation_about_z(degrees(view.angle_rad)) *
                         axis.table_from_board();
  double sum = 0.0;
  for (const Eigen::Vector3d& x : reach_points(reach_mm)) {
    sum += (view.camera_from_board * x - by_ring * x).squaredNorm();
  }
  return std::sqrt(sum / 4.0);
}

bool adjust_views(BundleProblem& problem, const CharucoBoard& board,
                  const std::optional<TableTrust>& trust) {
  CeresBundle bundle(problem);
  bundle.add_corners(board);
  if (trust) bundle.add_rings<ceres::HuberLoss>(*trust, 3.0 * std::sqrt(6.0));
  if (!bundle.solve()) return false;
  bundle.finish();
  return true;
}

bool adjust_views_by_points(BundleProblem& problem, const TableTrust& trust) {
  CeresBundle bundle(problem);
  bundle.add_sights();
  // A camera that was knocked is to lose touch with its ring.
  bundle.add_rings<ceres::CauchyLoss>(trust, 3.0);
  bundle.hold_frame(trust.reach_mm);
  return bundle.solve(BundleShape::many_points);
}

std::vector<Eigen::Matrix<double, 6, 6>> covariance_by_points(BundleProblem& problem,
                                                              double reach_mm) {
  CeresBundle bundle(problem);
  bundle.add_sights();
  return bundle.covariance_by_points(reach_mm);
}

bool adjust_rings(BundleProblem& problem, double reach_mm, double loss_mm) {
  if (std::ranges::none_of(problem.views, [](const BundleView& v) { return v.ring >= 0; })) {
    return false;
  }
  // The commanded angles fix where the station's zero is, and no more than that.
  constexpr double angle_sd_deg = 5.0;
  CeresBundle bundle(problem);
  bundle.add_rings<ceres::HuberLoss>({loss_mm, angle_sd_deg, reach_mm}, 1.0);
  bundle.hold_views();
  return bundle.solve();
}

std::optional<BundleCovariance> covariance_of(BundleProblem& problem, const CharucoBoard& board,
                                              const std::optional<TableTrust>& trust) {
  CeresBundle bundle(problem);
  bundle.add_corners(board);
  if (trust) bundle.add_rings<ceres::HuberLoss>(*trust, 3.0 * std::sqrt(6.0));
  return bundle.covariance();
}

}  // namespace skullstation
