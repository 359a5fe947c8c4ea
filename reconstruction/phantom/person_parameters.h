#pragma once

#include <cstdint>
#include <vector>

#include "reconstruction/phantom/craniometric_table.h"

namespace skullstation {

/// How a person's nose, mouth and ears deviate from what the bone foretells [mm].
struct FeatureResiduals {
  double pronasale_forward_mm = 0.0;
  double pronasale_down_mm = 0.0;
  double alar_width_mm = 0.0;
  double mouth_width_mm = 0.0;
  double ear_length_mm = 0.0;
  double ear_protrusion_mm = 0.0;
};

/// Thickness at a landmark pair [mm]; of a median one both are the same.
struct ThicknessPair {
  double left_mm = 0.0;
  double right_mm = 0.0;
};

/// All that a synthetic person is made from.
struct PersonParameters {
  std::uint64_t seed = 0;  ///< of the deformations that no parameter describes
  Sex sex = Sex::male;
  double age_years = 45.0;
  double bmi = 25.0;
  std::vector<double> craniometrics_mm;     ///< of craniometric_table()
  std::vector<ThicknessPair> thickness_mm;  ///< of thickness_table()
  FeatureResiduals features;
  /// In FDI two-digit notation, sockets healed; draw_person leaves all teeth in (tooth_loss.h).
  std::vector<int> missing_teeth;
  double mandible_opening_deg = 0.0;  ///< in [0, 8]; the lips stay closed
  double bone_freedom = 0.7;    ///< of the skull's shape beyond its measures; 1: the whole prior
  double tissue_freedom = 0.3;  ///< the same of the soft tissue
};

/// A person drawn from the tables: sex even, age from 18 to 85, BMI log-normal (25 +- 4), measures
/// of the skull multivariate normal by sex, thicknesses log-normal with the table's means and SDs.
/// The same seed gives the same person.
PersonParameters draw_person(std::uint64_t seed);

/// The average adult of a sex: every parameter at its mean, no freedom.
PersonParameters average_person(Sex sex);

}  // namespace skullstation
