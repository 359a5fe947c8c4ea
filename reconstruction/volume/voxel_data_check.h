#pragma once

#include <filesystem>

#include "core/result.h"

namespace skullstation {

/// Looks whether a NIfTI-1 file (.nii, .nii.gz) holds all the voxels that its header claims, and
/// whether floating-point ones are finite: the library under ITK fills up what is missing, and
/// replaces NaN, with zeros, which are soft tissue in Hounsfield units. Fails with `bad_input`,
/// naming the byte.
Result<void> check_nifti_data(const std::filesystem::path& path);

/// The same for the size of a MetaImage's data (.mha, or .mhd with its data file).
Result<void> check_meta_image_data(const std::filesystem::path& path);

}  // namespace skullstation
