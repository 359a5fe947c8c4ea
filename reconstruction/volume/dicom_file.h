#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// One slice of a DICOM image: the only frame of a CT Image, or one of an Enhanced CT Image.
struct DicomFrame {
  std::optional<Eigen::Vector3d> position_mm;                   ///< Image Position (Patient)
  Eigen::Vector3d row_direction = Eigen::Vector3d::UnitX();     ///< the way i goes
  Eigen::Vector3d column_direction = Eigen::Vector3d::UnitY();  ///< the way j goes
  Eigen::Vector2d pixel_spacing_mm = Eigen::Vector2d::Zero();   ///< along i, along j
  std::optional<double> slope;                                  ///< HU = slope * stored + intercept
  std::optional<double> intercept;
  std::string rescale_type;  ///< "HU", "US", ... or empty
  bool is_localizer = false;
};

/// What the header of a DICOM image file says.
struct DicomImage {
  std::filesystem::path path;
  std::string modality;
  std::string sop_class_uid;
  std::string series_uid;
  std::string series_number;
  std::string series_description;
  int rows = 0;
  int columns = 0;
  std::vector<DicomFrame> frames;
  /// How 16 bits hold a number of fewer (12 in 16, say); the other bits may hold anything.
  struct StoredBits {
    int top = 16;  ///< bits up to and including the number's highest
    int count = 16;
    bool is_signed = false;

    int value(std::uint16_t raw) const;
  };
  StoredBits bits;
  VolumeInfo info;           ///< without the identity
  PatientIdentity identity;  ///< kept apart, for those who may have it

  /// CT Image Storage, Enhanced or Legacy Converted Enhanced CT Image Storage.
  bool is_ct_image() const;
};

/// Reads a file's header. Nothing if it is no DICOM file or holds no image (a DICOMDIR, a report).
/// Fails with `bad_input` for a truncated file and a CT image without geometry, Hounsfield scale or
/// 16-bit grey pixels.
Result<std::optional<DicomImage>> read_dicom_header(const std::filesystem::path& path);

/// Decodes all frames of a file into Hounsfield units, one after the other, by each frame's slope
/// and intercept, rounded.
struct DecodedFrames {
  std::vector<std::int16_t> hu;
  std::size_t cut_off = 0;  ///< values that int16 could not hold
};
Result<DecodedFrames> decode_dicom_frames(const DicomImage& image);

}  // namespace skullstation
