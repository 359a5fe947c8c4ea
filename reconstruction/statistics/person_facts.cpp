#include "reconstruction/statistics/person_facts.h"

#include <string>

namespace skullstation {

Result<void> PersonFacts::validate() const {
  const auto bad = [](const char* fact, const char* range) {
    return fail(ErrorKind::usage, fact, std::string("must be ") + range);
  };
  if (male && *male != 0.0 && *male != 1.0) return bad("sex", "male or female");
  if (age_years && !(*age_years >= 15.0 && *age_years <= 110.0)) return bad("age", "15 to 110");
  if (body_mass_index && !(*body_mass_index >= 12.0 && *body_mass_index <= 70.0)) {
    return bad("body mass index", "12 to 70");
  }
  return {};
}

std::span<const Covariate> covariates() {
  static constexpr Covariate all[] = {{"male", &PersonFacts::male},
                                      {"age [years]", &PersonFacts::age_years},
                                      {"body mass index", &PersonFacts::body_mass_index}};
  return all;
}

}  // namespace skullstation
