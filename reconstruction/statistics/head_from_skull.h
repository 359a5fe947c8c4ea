#pragma once

#include <span>
#include <vector>

#include "core/result.h"
#include "reconstruction/statistics/joint_model.h"
#include "reconstruction/statistics/person_facts.h"
#include "reconstruction/statistics/population.h"
#include "reconstruction/statistics/shape_model.h"
#include "reconstruction/statistics/tissue_model.h"

namespace skullstation {

struct JointScoreOptions {
  int skull_modes = 40;  ///< that the joint model knows, at most
  int head_modes = 40;

  Result<void> validate() const;
};

/// Joint model of the subjects' coefficients and facts: the facts follow from the skull, the soft
/// tissue from the facts, the head from all. A fact takes part if most subjects have it and it
/// varies. `skulls` and `heads` are those that the models were built of.
Result<JointModel> joint_of(const ShapeModel& skull_model, std::span<const Points3> skulls,
                            const ShapeModel& head_model, std::span<const Points3> heads,
                            const TissueModel& tissue, std::span<const ModelSubject> subjects,
                            const JointScoreOptions& options);

/// What a joint model foretells of all its variables from the skull's coefficients [SD], as far as
/// they are known, and the facts that are known.
Belief foretold(const JointModel& joint, const Belief& skull, const PersonFacts& facts);

}  // namespace skullstation
