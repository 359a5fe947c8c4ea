#pragma once

#include <filesystem>

#include "daemon/delivery/package_objects.h"

namespace skullstation::testing {

/// Seals a small case below `folder` as folder/package: surfaces that are meshes, a JPEG and a PNG
/// photograph, a PDF report of an odd number of bytes. `large_bytes`: of a further file, and of the
/// skull as a binary STL file.
SealedPackage seal_small_case(const std::filesystem::path& folder, std::size_t large_bytes = 0);

}  // namespace skullstation::testing
