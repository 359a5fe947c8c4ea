#include "reconstruction/volume/image_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <string_view>
#include <utility>

#include "core/file.h"
#include "reconstruction/volume/itk_image.h"
#include "reconstruction/volume/text_header.h"
#include "reconstruction/volume/voxel_data_check.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> bad(const fs::path& path, std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, path.string(), std::move(what), std::move(advice));
}

std::optional<ImageFormat> format_of(const fs::path& path) {
  std::string name = path.filename().string();
  std::ranges::transform(name, name.begin(),
                         [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  if (name.ends_with(".nii") || name.ends_with(".nii.gz")) return ImageFormat::nifti;
  if (name.ends_with(".nrrd") || name.ends_with(".nhdr")) return ImageFormat::nrrd;
  if (name.ends_with(".mha") || name.ends_with(".mhd")) return ImageFormat::meta_image;
  return std::nullopt;
}

const char* to_string(ImageFormat format) {
  switch (format) {
    case ImageFormat::nifti: return "NIfTI";
    case ImageFormat::nrrd: return "NRRD";
    case ImageFormat::meta_image: return "MetaImage";
  }
  return "";
}

double unit_in_mm(LengthUnit unit) {
  switch (unit) {
    case LengthUnit::metre: return 1000.0;
    case LengthUnit::micrometre: return 1e-3;
    case LengthUnit::millimetre:
    case LengthUnit::as_declared: return 1.0;
  }
  return 1.0;
}

std::optional<double> unit_in_mm(std::string_view word) {
  if (word == "mm" || word == "millimeter" || word == "millimetre") return 1.0;
  if (word == "m" || word == "meter" || word == "metre") return 1000.0;
  if (word == "um" || word == "micron" || word == "micrometer") return 1e-3;
  return std::nullopt;
}

/// What the file itself declares about its geometry.
struct Declared {
  std::optional<double> unit_mm;
  bool has_orientation = false;
};

Declared declared_by_nifti(const ItkImage& image) {
  // NIfTI-1: bits 0 to 2 of xyzt_units are 1 for m, 2 for mm, 3 for um, 0 for unknown.
  constexpr std::array<double, 4> unit_mm = {0.0, 1000.0, 1.0, 1e-3};
  const auto code = static_cast<std::size_t>(image.xyzt_units & 7);
  Declared declared;
  if (code > 0 && code < unit_mm.size()) declared.unit_mm = unit_mm[code];
  declared.has_orientation = image.qform_code > 0 || image.sform_code > 0;
  return declared;
}

Declared declared_by_text(const fs::path& path, ImageFormat format) {
  const TextHeader header = read_text_header(path, format == ImageFormat::nrrd ? ':' : '=');
  Declared declared;
  if (format == ImageFormat::nrrd) {
    std::string unit = header.first_word("space units");
    std::erase(unit, '"');
    declared.unit_mm = unit_in_mm(std::string_view(unit));
    const std::string space = header.first_word("space");
    declared.has_orientation =
        !space.empty() && !space.starts_with("3D") && !space.starts_with("scanner");
    return declared;
  }
  declared.unit_mm = unit_in_mm(std::string_view(header.first_word("DistanceUnits")));
  declared.has_orientation = !header.first_word("TransformMatrix").empty() ||
                             !header.first_word("Orientation").empty() ||
                             !header.first_word("Rotation").empty();
  return declared;
}

Result<VoxelGrid> grid_of(const ItkImage& image, const fs::path& path) {
  VoxelGrid grid;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    grid.size[axis] = static_cast<int>(image.size[a]);
    grid.spacing_mm[axis] = image.spacing[a];
    grid.origin_mm[axis] = image.origin[a];
    grid.direction.col(axis) = Eigen::Vector3d(image.direction[a].data());
  }
  if (!grid.origin_mm.allFinite() || !grid.spacing_mm.allFinite() ||
      !(grid.spacing_mm.minCoeff() > 0.0)) {
    return bad(path, "its spacing or origin makes no sense");
  }
  const Eigen::Matrix3d product = grid.direction.transpose() * grid.direction;
  if (!((product - Eigen::Matrix3d::Identity()).norm() < 1e-3)) {
    return bad(path, "its axes are not at right angles", "resample it to an orthogonal grid");
  }
  return grid;
}

/// The factor from ITK's lengths to mm; a warning where it was not the file that said so.
Result<double> length_factor(ImageFormat format, const fs::path& path, const Declared& declared,
                             LengthUnit asked, std::vector<std::string>& warnings) {
  // ITK turns NIfTI's declared unit into mm itself, NRRD's and MetaImage's not.
  const double done_by_itk = format == ImageFormat::nifti ? declared.unit_mm.value_or(1.0) : 1.0;
  if (asked != LengthUnit::as_declared) {
    warnings.push_back(
        fmt::format("lengths were taken in units of {} mm, as asked", unit_in_mm(asked)));
    return unit_in_mm(asked) / done_by_itk;
  }
  if (declared.unit_mm) return *declared.unit_mm / done_by_itk;
  if (format == ImageFormat::nifti) {
    return bad(path, "declares no unit of length", "say which it is (--length-unit mm)");
  }
  warnings.push_back(fmt::format("the file declares no unit of length; mm, as is usual for {}",
                                 to_string(format)));
  return 1.0;
}

}  // namespace

bool is_image_file_name(const fs::path& path) { return format_of(path).has_value(); }

Result<Volume> read_image_file(const fs::path& path, const VolumeReadOptions& options) {
  const auto format = format_of(path);
  if (!format) return bad(path, "is no NIfTI, NRRD or MetaImage file by its name");
  if (!fs::is_regular_file(path)) return bad(path, "can't be read (no such file)");
  const auto complete = *format == ImageFormat::nifti        ? check_nifti_data(path)
                        : *format == ImageFormat::meta_image ? check_meta_image_data(path)
                                                             : Result<void>{};
  if (!complete) return forward(complete);
  auto image = read_with_itk(path, *format);
  if (!image) return forward(image);
  const Declared declared =
      *format == ImageFormat::nifti ? declared_by_nifti(*image) : declared_by_text(path, *format);
  const auto grid = grid_of(*image, path);
  if (!grid) return forward(grid);
  Volume volume{*grid, std::move(image->values), {}};
  volume.info.format = to_string(*format);
  auto& warnings = volume.info.warnings;
  if (!declared.has_orientation) {
    if (!options.assume_patient_axes) {
      return bad(path, "does not say which way its axes go in the patient",
                 "if they go left, posterior and superior, say so (--assume-patient-axes)");
    }
    volume.grid.direction.setIdentity();
    warnings.emplace_back("its axes were taken as left, posterior, superior, as asked");
  }
  const auto factor = length_factor(*format, path, declared, options.length_unit, warnings);
  if (!factor) return forward(factor);
  volume.grid.spacing_mm *= *factor;
  volume.grid.origin_mm *= *factor;
  if (image->cut_off > 0) {
    warnings.push_back(
        fmt::format("{} voxels lie beyond what 16 bits hold and were cut off", image->cut_off));
  }
  return volume;
}

Result<void> write_nifti(const Volume& volume, const fs::path& path) {
  if (format_of(path) != ImageFormat::nifti) {
    return fail(ErrorKind::usage, path.string(), "is no name for a NIfTI file",
                "name a .nii or .nii.gz file");
  }
  ItkImage image;
  for (std::size_t a = 0; a < 3; ++a) {
    const auto axis = static_cast<Eigen::Index>(a);
    image.size[a] = static_cast<std::size_t>(volume.grid.size[axis]);
    image.spacing[a] = volume.grid.spacing_mm[axis];
    image.origin[a] = volume.grid.origin_mm[axis];
    Eigen::Map<Eigen::Vector3d>(image.direction[a].data()) = volume.grid.direction.col(axis);
  }
  image.values = volume.hu;
  // ITK goes by the extension, so the temporary name keeps it.
  const fs::path temporary = path.parent_path() / (".part." + path.filename().string());
  const auto written = write_nifti_with_itk(image, temporary);
  const auto bytes = written ? read_file(temporary) : Result<std::string>(forward(written));
  std::error_code ignored;
  fs::remove(temporary, ignored);
  if (!bytes) return bad(path, bytes.error().what);
  return write_file_durably(path, *bytes);
}

}  // namespace skullstation
