#pragma once

#include <optional>
#include <span>

#include "core/result.h"

namespace skullstation {

/// What may be known of a person besides the skull.
struct PersonFacts {
  std::optional<double> male;  ///< 1 or 0
  std::optional<double> age_years;
  std::optional<double> body_mass_index;

  /// Fails with `usage` for what no adult has.
  Result<void> validate() const;
};

/// A fact as a variable of the joint model.
struct Covariate {
  const char* name;
  std::optional<double> PersonFacts::*value;
};
std::span<const Covariate> covariates();

}  // namespace skullstation
