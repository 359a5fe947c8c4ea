#include "reconstruction/approximation/case_skull.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "reconstruction/mesh/flat_cuts.h"
#include "reconstruction/registration/observed_bone.h"
#include "reconstruction/registration/similarity_fit.h"
#include "reconstruction/statistics/population.h"
#include "reconstruction/statistics/skull_completion.h"

namespace skullstation {

namespace {

constexpr int pose_rounds = 4;
/// Error of an observed vertex: the fit's, and the correspondence's along the surface.
constexpr double observed_sd_mm = 0.5;
constexpr double strange = 3.0;
constexpr double too_strange = 8.0;
constexpr double least_observed_share = 0.15;
/// Mean distance of what was scanned from the fitted template: one skull fits to half a millimetre.
constexpr double doubtful_mm = 1.5;
constexpr double too_far_mm = 5.0;

}  // namespace

Result<CaseSkull> fit_case_skull(const FaceModel& model, const TriangleMesh& input,
                                 const SkullRegistrationOptions& options,
                                 const Progress& progress) {
  // Where a scan ended is no bone.
  const auto fit =
      register_skull(model.skull_template, opened_at_flat_cuts(input), options, progress);
  if (!fit) return forward(fit);
  const SkullTemplate& skull = model.skull_template;
  CaseSkull result;
  result.observed = fit->observed;
  result.quality = fit->quality;
  const double share = observed_share(skull, fit->observed);
  if (share < least_observed_share) {
    return fail(ErrorKind::bad_input, "input skull",
                fmt::format("shows only {:.0f} % of a skull's outside", 100.0 * share),
                "scan more of it");
  }
  const double off_mm = std::max(fit->quality.outer.mean_mm, fit->quality.facial.mean_mm);
  if (off_mm > too_far_mm) {
    return fail(ErrorKind::bad_input, "input skull",
                fmt::format("lies {:.0f} mm from the fitted template on average", off_mm),
                "give one adult human skull and nothing else");
  }

  // Pose against what the model makes of the shape, in turns: size is kept, since it tells.
  Eigen::VectorXd weights = skull_weights(skull);
  for (int v = 0; v < skull.boundary_count; ++v) {
    if (!fit->observed[static_cast<std::size_t>(v)]) weights[v] = 0.0;
  }
  Points3 likely = unflattened(model.skull.mean);
  Similarity3 anatomical_from_input;
  const double unit = options.unit_unknown ? 1.0 / fit->input_from_template.scale : 1.0;
  for (int round = 0; round < pose_rounds; ++round) {
    const auto pose = fit_similarity(fit->vertices * unit, likely, weights, FitScale::one);
    if (!pose) return forward(pose);
    anatomical_from_input = *pose;
    anatomical_from_input.scale *= unit;
    result.vertices = fit->vertices;
    for (Eigen::Index v = 0; v < result.vertices.rows(); ++v) {
      const Eigen::Vector3d moved = anatomical_from_input * Eigen::Vector3d(fit->vertices.row(v));
      result.vertices.row(v) = moved;
    }
    result.belief = skull_belief(skull, model.skull, result.vertices, fit->observed);
    likely = shape_at(model.skull, result.belief.mean);
  }
  result.anatomical_from_input = anatomical_from_input;
  const CompletedSkull completed =
      completed_skull(skull, model.skull, result.vertices, fit->observed);
  result.vertices = completed.vertices;
  const std::vector<bool> everything(result.observed.size(), true);
  result.belief = skull_belief(skull, model.skull, result.vertices, everything);
  result.belief.covariance += completed.coefficient_covariance;
  result.sd_mm = completed.sd_mm.array().max(observed_sd_mm);
  result.strangeness =
      result.belief.mean.norm() /
      std::sqrt(static_cast<double>(std::max<Eigen::Index>(1, model.skull.mode_count())));
  if (result.strangeness > too_strange) {
    return fail(ErrorKind::bad_input, "input skull",
                fmt::format("lies {:.1f} standard deviations from the model's skulls: it is no "
                            "adult human skull in millimetres",
                            result.strangeness),
                "check the file and its unit");
  }
  if (result.strangeness > strange) {
    result.warnings.push_back(
        fmt::format("The skull lies {:.1f} standard deviations from those that the model was made "
                    "from: the face is doubtful.",
                    result.strangeness));
  }
  if (off_mm > doubtful_mm) {
    result.warnings.push_back(fmt::format(
        "What was scanned lies {:.1f} mm from the fitted skull on average: other objects "
        "are in the scan, or the face is doubtful.",
        off_mm));
  }
  if (share < 0.9) {
    result.warnings.push_back(fmt::format(
        "{:.0f} % of the skull's outside was observed; the rest was completed from the model.",
        100.0 * share));
  }
  return result;
}

}  // namespace skullstation
