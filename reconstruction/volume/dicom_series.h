#pragma once

#include <filesystem>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/volume/volume.h"
#include "reconstruction/volume/volume_options.h"

namespace skullstation {

/// Reads a CT series: the folder that holds it (and subfolders), one of its files, or a multi-frame
/// file. Slices are sorted by their position, whatever their names. A tilted gantry is undone and
/// uneven gaps up to 5 mm are interpolated, with a warning each. Localizers and files that are no
/// CT images are left out. Fails with `bad_input` for several CT series of which none was chosen
/// (the error lists them), for other modalities, missing or doubled slices, slices of different
/// size or orientation, values that are not Hounsfield units.
Result<Volume> read_dicom_series(const std::filesystem::path& path,
                                 const VolumeReadOptions& options, const Progress& progress = {});

/// True for a file that begins as DICOM files do (PS3.10: "DICM" at byte 128).
bool is_dicom_file(const std::filesystem::path& path);

}  // namespace skullstation
