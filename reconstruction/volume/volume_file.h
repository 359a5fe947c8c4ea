#pragma once

#include <filesystem>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/volume_options.h"

namespace skullstation {

/// Reads a CT volume in Hounsfield units: a folder or file of a DICOM series, a NIfTI, NRRD or
/// MetaImage file. See read_dicom_series, read_image_file and apply_hu_offset for what each
/// refuses; besides, spacings below 0.02 or above 20 mm are refused, since no head scan has them.
Result<Volume> read_volume(const std::filesystem::path& path, const VolumeReadOptions& options,
                           const Progress& progress = {});

}  // namespace skullstation
