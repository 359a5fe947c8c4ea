#pragma once

#include <string_view>

#include "reconstruction/phantom/person.h"

namespace skullstation {

/// What is left of a skull.
enum class Remains { complete, no_mandible, no_calvaria, half_face };

std::string_view to_string(Remains remains);

/// The part of the person's skull that is left. Half a face: its left is missing.
TriangleMesh remains_of(const Person& person, Remains remains);

}  // namespace skullstation
