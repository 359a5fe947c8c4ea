#include "reconstruction/volume/volume_file.h"

#include <fmt/format.h>

#include "reconstruction/volume/dicom_series.h"
#include "reconstruction/volume/hounsfield.h"
#include "reconstruction/volume/image_file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

Result<Volume> read_any(const fs::path& path, const VolumeReadOptions& options,
                        const Progress& progress) {
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return fail(ErrorKind::bad_input, path.string(), "does not exist");
  }
  if (fs::is_directory(path, ignored)) return read_dicom_series(path, options, progress);
  if (is_image_file_name(path)) return read_image_file(path, options);
  if (is_dicom_file(path)) return read_dicom_series(path, options, progress);
  return fail(ErrorKind::bad_input, path.string(), "is no CT volume that can be read",
              "name a DICOM folder or file, or a .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd file");
}

}  // namespace

Result<Volume> read_volume(const fs::path& path, const VolumeReadOptions& options,
                           const Progress& progress) {
  auto volume = read_any(path, options, progress);
  if (!volume) return volume;
  const Eigen::Vector3d& spacing_mm = volume->grid.spacing_mm;
  if (!(spacing_mm.minCoeff() >= 0.02 && spacing_mm.maxCoeff() <= 20.0)) {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("its voxels would measure {:.4g} x {:.4g} x {:.4g} mm", spacing_mm.x(),
                            spacing_mm.y(), spacing_mm.z()),
                "check the unit of length (--length-unit)");
  }
  if (const auto applied = apply_hu_offset(*volume, options, path.string()); !applied) {
    return forward(applied);
  }
  return volume;
}

}  // namespace skullstation
