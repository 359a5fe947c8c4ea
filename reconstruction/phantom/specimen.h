#pragma once

#include <cstdint>
#include <string_view>

#include "core/result.h"
#include "reconstruction/phantom/person.h"

namespace skullstation {

/// What a skull found in the ground may lack.
struct SpecimenDamage {
  bool missing_mandible = false;
  bool missing_calvaria = false;  ///< all above a plane 15 mm over the glabella
  bool hole = false;              ///< 30 mm wide, in the left parietal bone
};

/// Sets what the word says: "missing-mandible", "missing-calvaria" or "hole"; fails with `usage`
/// for another.
Result<void> add_damage(SpecimenDamage& damage, std::string_view word);

/// The person's bone as something to photograph: stained from ivory to brown in patches of 25 mm
/// down to 1.5 mm, as buried bone is (colours per vertex), less what the damage takes. Rims of
/// breaks are left open between the outer and the inner surface of the bone.
TriangleMesh specimen(const Person& person, const SpecimenDamage& damage, std::uint64_t seed);

}  // namespace skullstation
