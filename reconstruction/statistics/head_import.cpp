#include "reconstruction/statistics/head_import.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/registration/surface_places.h"

namespace skullstation {

namespace {

using Eigen::Index;

constexpr std::size_t multi_pie_count = 68;
/// Ours among the 68, whose left and right are the person's.
constexpr std::array<std::pair<std::size_t, const char*>, 9> multi_pie_names = {
    {{27, "nasion skin"},
     {30, "pronasale"},
     {33, "subnasale"},
     {36, "exocanthion right"},
     {39, "endocanthion right"},
     {42, "endocanthion left"},
     {45, "exocanthion left"},
     {48, "cheilion right"},
     {54, "cheilion left"}}};

/// Values at the corners of a place, weighted: 3 numbers a vertex.
Eigen::Vector3d at_place(const SurfacePoint& place, const Eigen::VectorXd& of_vertices) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int k = 0; k < 3; ++k) {
    sum += place.weights[k] * of_vertices.segment<3>(3 * Index{place.corners[k]});
  }
  return sum;
}

}  // namespace

Result<std::vector<VertexLandmark>> multi_pie_landmarks(const std::vector<int>& vertices) {
  if (vertices.size() != multi_pie_count) {
    return fail(
        ErrorKind::bad_input, "landmarks",
        fmt::format("{} vertices are not the {} of Multi-PIE", vertices.size(), multi_pie_count));
  }
  std::vector<VertexLandmark> landmarks;
  landmarks.reserve(std::size(multi_pie_names));
  for (const auto& [index, name] : multi_pie_names) landmarks.push_back({name, vertices[index]});
  return landmarks;
}

Result<ImportedHead> import_head(const FaceModel& base, const StatismoModel& foreign,
                                 const HeadImportOptions& options, const Progress& progress) {
  TriangleMesh mean;
  mean.vertices = unflattened(foreign.model.mean);
  mean.triangles = foreign.triangles;
  HeadRegistrationOptions fit_options;
  fit_options.seed = options.seed;
  fit_options.threads = options.threads;
  for (const VertexLandmark& landmark : options.landmarks) {
    if (landmark.vertex < 0 || landmark.vertex >= mean.vertices.rows()) {
      return fail(
          ErrorKind::bad_input, "landmark " + landmark.name,
          fmt::format("is vertex {} of a head of {}", landmark.vertex, mean.vertices.rows()));
    }
    fit_options.landmarks.push_back({landmark.name, mean.vertices.row(landmark.vertex)});
  }
  const auto fit = register_head(base.head_template, mean, fit_options, progress);
  if (!fit) return forward(fit);

  ImportedHead imported;
  imported.fit = fit->quality;
  imported.warnings = fit->warnings;
  const SurfacePlaces surface(mean);
  const Index count = base.head_template.vertices.rows();
  Points3 on_mean(count, 3);
  Eigen::VectorXd of_face(count);
  for (Index v = 0; v < count; ++v) {
    const auto at = static_cast<std::size_t>(v);
    imported.places.push_back(surface.nearest(fit->vertices.row(v)));
    on_mean.row(v) = imported.places[at].position(mean.vertices);
    of_face[v] = is_facial(base.head_template.region[at]) ? 1.0 : 0.0;
  }
  const auto pose = fit_similarity(on_mean, unflattened(base.head.mean), of_face, FitScale::one);
  if (!pose) return forward(pose);
  imported.anatomical_from_foreign = *pose;

  Points3 anatomical(count, 3);
  for (Index v = 0; v < count; ++v) {
    anatomical.row(v) = *pose * Eigen::Vector3d(on_mean.row(v));
  }
  const Eigen::MatrixXd foreign_modes = foreign.model.scaled_modes();
  Eigen::MatrixXd modes(3 * count, foreign_modes.cols());
  for (Index k = 0; k < modes.cols(); ++k) {
    const Eigen::VectorXd mode = foreign_modes.col(k);
    for (Index v = 0; v < count; ++v) {
      modes.col(k).segment<3>(3 * v) =
          pose->rotation * at_place(imported.places[static_cast<std::size_t>(v)], mode);
    }
  }
  imported.model = shape_model_of(flattened(anatomical), modes, foreign.model.noise_variance);
  if (const auto sound = imported.model.validate(); !sound) return forward(sound);
  return imported;
}

FaceModel with_head(FaceModel base, ShapeModel head) {
  base.head = std::move(head);
  base.bands.clear();
  JointModel& joint = base.joint;
  std::vector<Index> kept;
  std::vector<std::string> names;
  for (std::size_t i = 0; i < joint.names.size(); ++i) {
    if (joint.names[i].starts_with("head ")) continue;
    kept.push_back(static_cast<Index>(i));
    names.push_back(joint.names[i]);
  }
  joint.names = std::move(names);
  joint.mean = Eigen::VectorXd(joint.mean(kept));
  joint.covariance = Eigen::MatrixXd(joint.covariance(kept, kept));
  return base;
}

}  // namespace skullstation
