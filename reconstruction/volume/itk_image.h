#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// The formats that ITK reads for us.
enum class ImageFormat { nifti, nrrd, meta_image };

/// A 3-D grey image as ITK tells it, in ITK's convention: LPS. Plain types, since ITK brings an
/// Eigen of its own that can't be in one translation unit with ours.
struct ItkImage {
  std::array<std::size_t, 3> size{};
  std::array<double, 3> spacing{};
  std::array<double, 3> origin{};
  std::array<std::array<double, 3>, 3> direction{};  ///< one unit vector for each axis
  /// NIfTI's own codes; 0 in other formats.
  int xyzt_units = 0;
  int qform_code = 0;
  int sform_code = 0;
  std::vector<std::int16_t> values;  ///< rounded; x fastest
  std::size_t cut_off = 0;           ///< values that int16 could not hold
};

/// Reads the only 3-D volume of a file. Fails with `bad_input` for other dimensions, colours,
/// values that are not finite, more than 2000 million voxels, and what ITK refuses.
Result<ItkImage> read_with_itk(const std::filesystem::path& path, ImageFormat format);

/// Writes geometry (mm) and values as NIfTI; the extension says whether compressed.
Result<void> write_nifti_with_itk(const ItkImage& image, const std::filesystem::path& path);

}  // namespace skullstation
