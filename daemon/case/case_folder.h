#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/case/face_pictures.h"
#include "reconstruction/approximation/case_skull.h"
#include "reconstruction/approximation/face_estimate.h"

namespace skullstation {

/// What a case was made from.
struct CaseSource {
  std::string input;  ///< file name of the skull's mesh
  std::string input_sha256;
  std::string model;  ///< file name
  std::string model_sha256;
  std::string model_card;  ///< what the model was made from, in plain words
  std::string program_version;
  PersonFacts facts;
  std::string ancestry;       ///< as told; no model knows what to do with it
  std::string tissue;         ///< where the depths come from, in plain words
  std::string tissue_sha256;  ///< of the file of depths that were told; empty: none
  int variant_steps = 3;      ///< of each of the two tissue variations: 1, 3 or 5
  std::uint64_t seed = 1;
};

/// One of the faces that are as plausible as the mean one: `steps` standard deviations along each
/// of the face's first variations.
struct FaceVariant {
  std::string name;  ///< "tissue 1 +2, tissue 2 -2"
  Points3 head;
};

/// The grid of the paper, -2 to +2 standard deviations along the first two tissue variations (fewer
/// where the model has fewer), and leaner and fuller where the body mass index is unknown.
/// \param steps of each variation: 1 (the mean alone), 3 (-2, 0, +2; the paper's), 5
std::vector<FaceVariant> face_variants(const FaceEstimate& face, int steps = 3);

/// Writes a case: skull_fitted.ply, head.ply, head.glb (variations as morph targets), variants/,
/// spheres.ply, uncertainty.ply (sd_mm, band80_mm, from_bone for each vertex), tissue.csv,
/// case.json, report.html, report.pdf, preview_*.png. The folder appears whole or not at all. The
/// same bytes for any number of threads. Fails with `usage` where the folder is there already,
/// `cancelled` on request.
Result<void> write_case_folder(const FaceModel& model, const CaseSkull& skull,
                               const FaceEstimate& face, const CaseSource& source,
                               const std::filesystem::path& folder,
                               const ReportPictureOptions& picture_options,
                               const Progress& progress = {});

}  // namespace skullstation
