#pragma once

#include <filesystem>
#include <string>

#include "daemon/evidence/package_source.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation::testing {

/// Writes what is to be sealed below `folder` by hand: case/ (with a file of `large_bytes`),
/// session/ (two photographs), reconstruction/; returns them as a source with all three.
PackageSource write_small_case(const std::filesystem::path& folder,
                               std::size_t large_bytes = 600'000);

/// The keys of station "TEST", made once for the program.
const StationKeys& test_keys();
/// The folder that they are in.
const std::filesystem::path& test_keys_folder();

/// Bytes that look like nothing, the same for the same seed.
std::string noise(std::size_t bytes, std::uint64_t seed);

/// Flips bits of one byte of a file in place; `flip` is not 0.
void change_byte(const std::filesystem::path& file, std::uint64_t offset, unsigned char flip);

/// SKULLSTATION_LONG=1
bool long_form();

}  // namespace skullstation::testing
