#pragma once

#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/registration/head_registration.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/statistics/model_file.h"

namespace skullstation {

/// A vertex of a foreign head model that is a landmark of our template.
struct VertexLandmark {
  std::string name;
  int vertex = 0;
};

/// The landmarks of ours among the 68 of Multi-PIE (Gross et al. 2010; as iBUG numbers them), given
/// as the vertices of all 68 in their order. Fails with `bad_input` for another number of them.
Result<std::vector<VertexLandmark>> multi_pie_landmarks(const std::vector<int>& vertices);

struct HeadImportOptions {
  std::vector<VertexLandmark> landmarks;  ///< may be empty: the pose is found then
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all
};

/// A head model of other people's over our template's vertices.
struct ImportedHead {
  ShapeModel model;  ///< in the anatomical frame of the model that it is for
  /// Where each of our vertices lies on the foreign mean.
  std::vector<SurfacePoint> places;
  Similarity3 anatomical_from_foreign;
  HeadFitQuality fit;  ///< of our template to the foreign mean
  std::vector<std::string> warnings;
};

/// Registers the template of `base` to the foreign mean and carries the modes over: each of our
/// vertices moves as the place of the foreign surface does on which it lies. Size is kept. Fails
/// with `bad_input` for landmarks that are no vertices, and as register_head does.
Result<ImportedHead> import_head(const FaceModel& base, const StatismoModel& foreign,
                                 const HeadImportOptions& options, const Progress& progress = {});

/// `base` with another head model. Nothing is known of how those heads go with skulls: the joint
/// model has no variables of the head, and the bands are a Gaussian's.
FaceModel with_head(FaceModel base, ShapeModel head);

}  // namespace skullstation
