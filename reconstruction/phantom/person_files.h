#pragma once

#include <filesystem>

#include "core/result.h"
#include "reconstruction/phantom/person.h"

namespace skullstation {

/// Writes a subject folder: skull.ply, skin.ply, landmarks.json, subject.json, thickness.csv (at
/// the landmarks: drawn, and by closest distance) and truth.json (all parameters and measures).
/// Fails where the folder can't be written.
Result<void> write_person(const Person& person, const std::filesystem::path& folder);

}  // namespace skullstation
