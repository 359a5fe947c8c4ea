#pragma once

#include <filesystem>

#include "core/result.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/volume_options.h"

namespace skullstation {

/// Reads NIfTI (.nii, .nii.gz), NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) through ITK, told
/// apart by the extension; values are taken as Hounsfield units as the file scales them and are
/// rounded. NIfTI must declare its unit of length and its orientation; NRRD and MetaImage have mm
/// by convention (a warning says so) and must state their orientation. `options` can supply what
/// is missing. Fails with `bad_input` for anything but one 3-D grey volume of finite values.
Result<Volume> read_image_file(const std::filesystem::path& path, const VolumeReadOptions& options);

/// True for the extensions that read_image_file knows.
bool is_image_file_name(const std::filesystem::path& path);

/// Writes .nii or .nii.gz: int16, mm, orientation as sform and qform. NIfTI keeps geometry in
/// single precision. Whole or not at all.
Result<void> write_nifti(const Volume& volume, const std::filesystem::path& path);

}  // namespace skullstation
