#include "reconstruction/registration/head_registration.h"

#include <fmt/format.h>

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/registration/bending_energy.h"
#include "reconstruction/registration/head_fit_quality.h"
#include "reconstruction/registration/head_pairs.h"
#include "reconstruction/registration/input_check.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_tree.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/registration/surface_pose.h"

namespace skullstation {

namespace {

using Matrix = Eigen::SparseMatrix<double>;

enum class Pairs { alike, nearest, sliding };  ///< the last from all points

/// A stretch of iterations at one stiffness; landmarks of `landmark_weight`, all of them together,
/// in units of all points'.
struct Level {
  double bending_mm4;
  HeadPairLimits limits;
  double landmark_weight;
  Pairs pairs;
  int iterations;
};

/// Stiff to soft; the fourth root is about the length over which the skin may bend.
constexpr Level kLevels[] = {
    {1e6, {20.0, 60.0}, 10.0, Pairs::alike, 8},  {1e5, {14.0, 55.0}, 5.0, Pairs::alike, 8},
    {1e4, {10.0, 50.0}, 1.0, Pairs::alike, 8},   {1e3, {7.0, 45.0}, 0.5, Pairs::alike, 8},
    {1e2, {5.0, 45.0}, 0.2, Pairs::alike, 8},    {1e1, {4.0, 40.0}, 0.1, Pairs::nearest, 3},
    {1.0, {3.0, 40.0}, 0.02, Pairs::sliding, 3}, {0.1, {2.0, 40.0}, 0.0, Pairs::sliding, 3},
};
constexpr double kCoarseSpacing_mm = 4.0;
constexpr double kFineSpacing_mm = 1.5;
constexpr double kTangentialShare = 0.15;

Result<ScanPoints> scan_points(const TriangleMesh& scan, const std::vector<double>& vertex_weight,
                               double spacing_mm) {
  auto points = oriented_samples(scan, spacing_mm);
  if (!points) return forward(points);
  ScanPoints result{*std::move(points), {}};
  result.weight = Eigen::VectorXd::Ones(result.points.size());
  if (!vertex_weight.empty()) {
    const PointTree tree(scan.vertices);
    for (Eigen::Index i = 0; i < result.points.size(); ++i) {
      const NearPoint near = tree.nearest(result.points.positions.row(i));
      result.weight[i] = vertex_weight[static_cast<std::size_t>(near.index)];
    }
  }
  return result;
}

class Fit {
 public:
  Fit(const HeadTemplate& head, Points3 start, const HeadRegistrationOptions& options,
      const std::vector<InputLandmark>& landmarks)
      : head_(head),
        options_(options),
        rim_(boundary_vertices(head.triangles, head.vertices.rows())),
        vertices_(std::move(start)) {
    for (const InputLandmark& given : landmarks) {
      for (const TemplateLandmark& own : head.landmarks) {
        if (own.name == given.name) landmarks_.push_back({own.place, given.position_mm});
      }
    }
  }

  void run(const Level& level, const ScanPoints& scan) {
    const double began_s = processor_seconds();
    const Points3 rest = vertices_;  // the rest state follows each time the skin gets softer
    const std::vector<EdgeFlap> flaps = edge_flaps(rest, head_.triangles);
    const Matrix bending = bending_matrix(flaps, rest.rows());
    FitStage stage;
    stage.name = fmt::format("bending {:g} mm^4", level.bending_mm4);
    for (int i = 0; i < level.iterations; ++i) {
      pair_up(scan, level);
      const Points3 before = vertices_;
      solve(level, flaps, bending, rest);
      ++stage.iterations;
      stage.last_move_mm = (vertices_ - before).rowwise().norm().mean();
      if (stage.last_move_mm < 0.005) break;
    }
    stage.correspondences = distances_.count;
    stage.rms_mm = distances_.rms_mm;
    stage.processor_seconds = processor_seconds() - began_s;
    stages_.push_back(std::move(stage));
  }

  const Points3& vertices() const { return vertices_; }
  FitStages take_stages() { return std::move(stages_); }

 private:
  struct PlacedLandmark {
    SurfacePoint place;
    Eigen::Vector3d position_mm;
  };

  void pair_up(const ScanPoints& scan, const Level& level) {
    const int threads = options_.threads;
    if (level.pairs == Pairs::alike) {
      pairs_ = alike_pairs(head_, vertices_, rim_, scan, level.limits, threads);
    } else {
      const double tangential = level.pairs == Pairs::sliding ? kTangentialShare : 1.0;
      pairs_ = nearest_pairs(head_, vertices_, rim_, scan, level.limits, tangential, threads);
    }
    distances_ = weigh(pairs_, vertices_);
  }

  void solve(const Level& level, const std::vector<EdgeFlap>& flaps, const Matrix& bending,
             const Points3& rest) {
    const Eigen::Index count = vertices_.rows();
    double all = 0.0;
    for (const HeadPair& pair : pairs_) all += pair.weight;
    if (all <= 0.0) return;
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(9 * pairs_.size());
    Points3 right = level.bending_mm4 * rotated_rest_pull(flaps, rest, vertices_, options_.threads);
    const auto add = [&](const SurfacePoint& place, const Eigen::Vector3d& target, double weight) {
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          entries.emplace_back(place.corners[i], place.corners[j],
                               weight * place.weights[i] * place.weights[j]);
        }
        right.row(place.corners[i]) += weight * place.weights[i] * target.transpose();
      }
    };
    for (const HeadPair& pair : pairs_) {
      if (pair.weight > 0.0) add(pair.place, pair.target, pair.weight / all);
    }
    for (const PlacedLandmark& landmark : landmarks_) {
      add(landmark.place, landmark.position_mm,
          level.landmark_weight / static_cast<double>(landmarks_.size()));
    }
    // Holds what neither data nor bending decide.
    const double hold = 1e-6 / static_cast<double>(count);
    for (Eigen::Index v = 0; v < count; ++v) {
      entries.emplace_back(static_cast<int>(v), static_cast<int>(v), hold);
    }
    right += hold * vertices_;
    Matrix data(count, count);
    data.setFromTriplets(entries.begin(), entries.end());
    const Matrix sum = data + level.bending_mm4 * bending;
    const Eigen::SimplicialLDLT<Matrix> factor(sum);
    if (factor.info() != Eigen::Success) return;  // stays where it is; the quality tells
    using Columns = Eigen::Matrix<double, Eigen::Dynamic, 3>;
    const Columns columns = right;
    vertices_ = factor.solve(columns);
  }

  const HeadTemplate& head_;
  const HeadRegistrationOptions& options_;
  std::vector<bool> rim_;
  std::vector<PlacedLandmark> landmarks_;
  Points3 vertices_;
  std::vector<HeadPair> pairs_;
  HeadPairDistances distances_;
  FitStages stages_;
};

Points3 moved(const Points3& points, const Similarity3& transform) {
  Points3 result(points.rows(), 3);
  for (Eigen::Index v = 0; v < points.rows(); ++v) {
    result.row(v) = (transform * points.row(v).transpose()).transpose();
  }
  return result;
}

}  // namespace

Result<void> HeadRegistrationOptions::validate() const {
  if (threads < 0) return fail(ErrorKind::usage, "threads", "must be 0 or more");
  for (const double weight : input_weight) {
    if (!(weight >= 0.0 && weight <= 1.0)) {
      return fail(ErrorKind::usage, "input weight", "must lie in [0, 1]");
    }
  }
  return {};
}

Result<FittedHead> register_head(const HeadTemplate& head, const TriangleMesh& input,
                                 const HeadRegistrationOptions& options, const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (const auto valid = check_input(input, "head", options.unit_unknown); !valid) {
    return forward(valid);
  }
  if (!options.input_weight.empty() &&
      static_cast<Eigen::Index>(options.input_weight.size()) != input.vertices.rows()) {
    return fail(ErrorKind::usage, "input weight", "needs one number for each vertex of the input");
  }
  if (options.start.rows() > 0 && options.start.rows() != head.vertices.rows()) {
    return fail(ErrorKind::usage, "start", "needs the template's vertices");
  }
  const double began_s = processor_seconds();
  progress.report(0.0, "pose");
  Points3 own(static_cast<Eigen::Index>(options.landmarks.size()), 3);
  Points3 given(own.rows(), 3);
  for (Eigen::Index i = 0; i < own.rows(); ++i) {
    const InputLandmark& landmark = options.landmarks[static_cast<std::size_t>(i)];
    const auto found = std::ranges::find(head.landmarks, landmark.name, &TemplateLandmark::name);
    if (found == head.landmarks.end()) {
      return fail(ErrorKind::bad_input, landmark.name, "the head template has no such landmark");
    }
    own.row(i) = found->place.position(head.vertices).transpose();
    given.row(i) = landmark.position_mm.transpose();
  }
  Similarity3 pose;
  if (options.pose != nullptr) {
    pose = *options.pose;
  } else if (own.rows() >= 4) {
    const auto found = fit_similarity(own, given, {}, FitScale::symmetric);
    if (!found) return forward(found);
    pose = *found;
  } else {
    const auto found = find_surface_pose(
        surface_of(head, head.vertices), input,
        {.unit_unknown = options.unit_unknown, .seed = options.seed, .threads = options.threads});
    if (!found) return forward(found);
    pose = *found;
  }
  // Millimetres of the input, unless nobody knows its unit.
  const double unit = options.unit_unknown ? pose.scale : 1.0;
  TriangleMesh scan = input;
  scan.vertices /= unit;
  std::vector<InputLandmark> landmarks = options.landmarks;
  for (InputLandmark& landmark : landmarks) landmark.position_mm /= unit;
  Points3 start = options.start.rows() > 0 ? options.start : moved(head.vertices, pose);
  start /= unit;

  const auto coarse = scan_points(scan, options.input_weight, kCoarseSpacing_mm);
  if (!coarse) return forward(coarse);
  const auto fine = scan_points(scan, options.input_weight, kFineSpacing_mm);
  if (!fine) return forward(fine);
  FittedHead fitted;
  fitted.stages.push_back({"pose", 1, 0, 0.0, 0.0, processor_seconds() - began_s});
  Fit fit(head, std::move(start), options, landmarks);
  int number = 0;
  for (const Level& level : kLevels) {
    if (progress.stop.stop_requested()) return fail(ErrorKind::cancelled, "head", "cancelled");
    progress.report(0.2 + 0.7 * number++ / static_cast<double>(std::size(kLevels)),
                    "fitting the skin");
    fit.run(level, level.pairs == Pairs::sliding ? *fine : *coarse);
  }
  measure_head_fit(head, fit.vertices(), scan, *fine, options.threads, fitted);
  for (FitStage& stage : fit.take_stages()) fitted.stages.push_back(std::move(stage));
  fitted.vertices = unit * fit.vertices();
  const auto similarity = fit_similarity(head.vertices, fitted.vertices, {}, FitScale::to_target);
  fitted.input_from_template = similarity.value_or(pose);
  if (fitted.quality.kept_share < 0.8) {
    fitted.warnings.push_back(
        fmt::format("only {:.0f} % of the input lies within 2 mm of the fitted head",
                    100.0 * fitted.quality.kept_share));
  }
  return fitted;
}

}  // namespace skullstation
