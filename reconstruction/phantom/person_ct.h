#pragma once

#include <string_view>

#include "reconstruction/phantom/person.h"
#include "reconstruction/phantom/phantom_ct.h"

namespace skullstation {

/// The person as something to be scanned. The person must outlive it.
PhantomBody body_of(const Person& person);

/// Adds what is wrong with a scan: "cropped-calvaria" (25 mm), "cropped-nose" (12 mm), "head-rest",
/// "table", "metal" (two fillings) or "padding". Fails with `usage` for another word.
Result<void> add_flaw(PhantomCtOptions& options, const Person& person, std::string_view word);

}  // namespace skullstation
