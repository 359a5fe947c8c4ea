#pragma once

#include <Eigen/Core>
#include <span>
#include <string>
#include <vector>

#include "core/result.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_template.h"
#include "reconstruction/statistics/person_facts.h"
#include "reconstruction/statistics/shape_model.h"
#include "reconstruction/statistics/tissue_model.h"

namespace skullstation {

/// A person to learn from: both templates fitted to the person's surfaces, in the person's frame.
struct ModelSubject {
  std::string name;
  Points3 skull;                     ///< skull template's vertices x 3 [mm]
  std::vector<bool> skull_observed;  ///< its surface vertices: the scan shows bone there
  Points3 head;                      ///< head template's vertices x 3 [mm]
  Eigen::VectorXd tissue_mm;         ///< tissue_thickness() at the skull's surface vertices
  PersonFacts facts;
};

/// Weights of the skull template's vertices for statistics: the area round outer surface vertices,
/// 0 elsewhere.
Eigen::VectorXd skull_weights(const SkullTemplate& skull);

/// Every subject turned and moved (size kept) so that the outer skulls lie on their common mean and
/// the mean on the template: generalised Procrustes alignment (Gower 1975) without scale. The head
/// goes along with its skull. Fails with `bad_input` naming the subject whose tables don't fit the
/// templates.
Result<std::vector<ModelSubject>> aligned_population(const SkullTemplate& skull,
                                                     const HeadTemplate& head,
                                                     std::vector<ModelSubject> subjects);

/// What the observed outer vertices of a fitted skull (#V x 3, aligned) tell about its
/// coefficients.
Belief skull_belief(const SkullTemplate& skull, const ShapeModel& model, const Points3& vertices,
                    const std::vector<bool>& observed);

/// Skulls of which a good part was not observed (a cropped calvaria) are completed by the model of
/// the others, as in the paper's second pass. Who shows nearly as much bone (98 %) as whoever shows
/// most teaches the others. Nothing changes where these are fewer than 10.
void complete_skulls(const SkullTemplate& skull, std::vector<ModelSubject>& subjects);

/// Tissue of both halves of the face together: each subject teaches with its mirror image.
Result<TissueModel> population_tissue_model(const SkullTemplate& skull,
                                            std::span<const ModelSubject> subjects,
                                            const TissueModelOptions& options = {});

}  // namespace skullstation
