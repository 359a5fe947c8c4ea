#include "reconstruction/volume/dicom_writer.h"

#include <fmt/format.h>
#include <gdcmAttribute.h>
#include <gdcmTrace.h>
#include <gdcmWriter.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <sstream>
#include <string_view>

#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr const char* ct_image_storage = "1.2.840.10008.5.1.4.1.1.2";
constexpr int twelve_bit_intercept = -1024;

/// A UID below 2.25 (PS3.5 B.2) that stands for the words: 128 bits of their SHA-256, in decimal.
std::string uid_for(const std::string& words) {
  std::string hex = sha256_hex(words).substr(0, 32);
  std::string decimal;
  while (hex.find_first_not_of('0') != std::string::npos) {
    int remainder = 0;
    for (char& digit : hex) {
      const int value = remainder * 16 + (digit <= '9' ? digit - '0' : digit - 'a' + 10);
      const int quotient = value / 10;
      digit = static_cast<char>(quotient < 10 ? '0' + quotient : 'a' + quotient - 10);
      remainder = value % 10;
    }
    decimal.insert(decimal.begin(), static_cast<char>('0' + remainder));
  }
  return "2.25." + (decimal.empty() ? "0" : decimal);
}

/// A number in the 16 characters that a decimal string has at most, as exactly as they allow.
std::string decimal_string(double number) {
  for (int digits = 15; digits > 0; --digits) {
    std::string text = fmt::format("{:.{}g}", number + 0.0, digits);
    if (text.size() <= 16) return text;
  }
  return "0";
}

std::string decimal_strings(std::initializer_list<double> numbers) {
  std::string text;
  for (const double number : numbers) {
    if (!text.empty()) text += '\\';
    text += decimal_string(number);
  }
  return text;
}

/// The elements of a data set, added one after the other.
class Elements {
 public:
  explicit Elements(gdcm::DataSet& data) : data_(data) {}

  void text(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType type, std::string value) {
    if (value.size() % 2 == 1) value += type == gdcm::VR::UI ? '\0' : ' ';
    bytes(group, element, type, value);
  }

  void bytes(std::uint16_t group, std::uint16_t element, gdcm::VR::VRType type,
             std::string_view value) {
    gdcm::DataElement entry(gdcm::Tag(group, element));
    entry.SetVR(type);
    entry.SetByteValue(value.data(), gdcm::VL(static_cast<std::uint32_t>(value.size())));
    data_.Replace(entry);
  }

  void number(std::uint16_t group, std::uint16_t element, int value) {
    const std::array<char, 2> little_endian{static_cast<char>(value & 255),
                                            static_cast<char>(value >> 8)};
    bytes(group, element, gdcm::VR::US, std::string_view(little_endian.data(), 2));
  }

 private:
  gdcm::DataSet& data_;
};

struct SeriesWords {
  const Volume* volume;
  const DicomWriteOptions* options;
  std::string seed;  // what the UIDs are made from
};

void add_patient_study_series(Elements& add, const SeriesWords& series) {
  using gdcm::VR;
  const VolumeInfo& info = series.volume->info;
  add.text(0x0008, 0x0005, VR::CS, "ISO_IR 192");
  add.text(0x0010, 0x0010, VR::PN, series.options->patient_name);
  add.text(0x0010, 0x0020, VR::LO, series.options->patient_id);
  add.text(0x0010, 0x0030, VR::DA, "");
  add.text(0x0010, 0x0040, VR::CS, info.sex);
  if (info.age_years) add.text(0x0010, 0x1010, VR::AS, fmt::format("{:03}Y", *info.age_years));
  add.text(0x0020, 0x000d, VR::UI, uid_for(series.seed + "study"));
  add.text(0x0008, 0x0020, VR::DA, "");
  add.text(0x0008, 0x0030, VR::TM, "");
  add.text(0x0008, 0x0090, VR::PN, "");
  add.text(0x0020, 0x0010, VR::SH, "1");
  add.text(0x0008, 0x0050, VR::SH, "");
  add.text(0x0008, 0x0060, VR::CS, "CT");
  add.text(0x0020, 0x000e, VR::UI, uid_for(series.seed + "series"));
  add.text(0x0020, 0x0011, VR::IS, fmt::format("{}", series.options->series_number));
  if (!series.options->series_description.empty()) {
    add.text(0x0008, 0x103e, VR::LO, series.options->series_description);
  }
  add.text(0x0018, 0x5100, VR::CS, "HFS");
  add.text(0x0020, 0x0052, VR::UI, uid_for(series.seed + "frame of reference"));
  add.text(0x0020, 0x1040, VR::LO, "");
  add.text(0x0008, 0x0070, VR::LO, info.manufacturer);
  if (!info.scanner_model.empty()) add.text(0x0008, 0x1090, VR::LO, info.scanner_model);
  if (!info.convolution_kernel.empty()) add.text(0x0018, 0x1210, VR::SH, info.convolution_kernel);
}

void add_slice(Elements& add, const SeriesWords& series, int k) {
  using gdcm::VR;
  const VoxelGrid& grid = series.volume->grid;
  add.text(0x0008, 0x0016, VR::UI, ct_image_storage);
  add.text(0x0008, 0x0018, VR::UI, uid_for(series.seed + fmt::format("slice {}", k)));
  add.text(0x0008, 0x0008, VR::CS, "DERIVED\\SECONDARY\\AXIAL");
  add.text(0x0020, 0x0012, VR::IS, "1");
  add.text(0x0020, 0x0013, VR::IS, fmt::format("{}", k + 1));
  const Eigen::Vector3d position = grid.patient_from_voxel({0, 0, static_cast<double>(k)});
  const Eigen::Vector3d row = grid.direction.col(0);
  const Eigen::Vector3d column = grid.direction.col(1);
  add.text(0x0020, 0x0032, VR::DS, decimal_strings({position.x(), position.y(), position.z()}));
  add.text(0x0020, 0x0037, VR::DS,
           decimal_strings({row.x(), row.y(), row.z(), column.x(), column.y(), column.z()}));
  add.text(0x0028, 0x0030, VR::DS, decimal_strings({grid.spacing_mm.y(), grid.spacing_mm.x()}));
  add.text(0x0018, 0x0050, VR::DS,
           decimal_string(series.volume->info.slice_thickness_mm.value_or(grid.spacing_mm.z())));
  const auto& voltage = series.volume->info.tube_voltage_kv;
  add.text(0x0018, 0x0060, VR::DS, voltage ? decimal_string(*voltage) : "");
}

void add_pixels(Elements& add, const SeriesWords& series, int k) {
  using gdcm::VR;
  const Volume& volume = *series.volume;
  const bool twelve_bit = series.options->twelve_bit;
  add.number(0x0028, 0x0002, 1);
  add.text(0x0028, 0x0004, VR::CS, "MONOCHROME2");
  add.number(0x0028, 0x0010, volume.grid.size.y());
  add.number(0x0028, 0x0011, volume.grid.size.x());
  add.number(0x0028, 0x0100, 16);
  add.number(0x0028, 0x0101, twelve_bit ? 12 : 16);
  add.number(0x0028, 0x0102, twelve_bit ? 11 : 15);
  add.number(0x0028, 0x0103, twelve_bit ? 0 : 1);
  const int intercept = twelve_bit ? twelve_bit_intercept : 0;
  add.text(0x0028, 0x1052, VR::DS, fmt::format("{}", intercept));
  add.text(0x0028, 0x1053, VR::DS, "1");
  add.text(0x0028, 0x1054, VR::LO, "HU");
  std::string pixels;
  const std::size_t count = static_cast<std::size_t>(volume.grid.size.x()) *
                            static_cast<std::size_t>(volume.grid.size.y());
  pixels.reserve(2 * count);
  const std::size_t first = volume.grid.index(0, 0, k);
  for (std::size_t i = first; i < first + count; ++i) {
    const auto stored = static_cast<std::uint16_t>(volume.hu[i] - intercept);
    pixels += static_cast<char>(stored & 255);
    pixels += static_cast<char>(stored >> 8);
  }
  add.bytes(0x7fe0, 0x0010, VR::OW, pixels);
}

Result<std::string> slice_file(const SeriesWords& series, int k) {
  gdcm::Writer writer;
  Elements add(writer.GetFile().GetDataSet());
  add_patient_study_series(add, series);
  add_slice(add, series, k);
  add_pixels(add, series, k);
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(
      gdcm::TransferSyntax::ExplicitVRLittleEndian);
  std::ostringstream stream;
  writer.SetStream(stream);
  if (!writer.Write()) {
    return fail(ErrorKind::no_result, "DICOM writer", fmt::format("slice {} failed", k));
  }
  return std::move(stream).str();
}

Result<void> check(const Volume& volume, const fs::path& folder, const DicomWriteOptions& options) {
  const auto bad = [&](const char* what) { return fail(ErrorKind::usage, folder.string(), what); };
  if (fs::exists(folder)) return bad("exists already; a series is written into a new folder");
  if (volume.grid.count() == 0 || volume.grid.count() != volume.hu.size()) {
    return bad("the volume has no voxels, or not as many as its grid");
  }
  if (volume.grid.size.head<2>().maxCoeff() > 65535) return bad("the slices are too large");
  if (volume.grid.direction.determinant() < 0.0) {
    return bad("the grid is left-handed, which a series can't be; orient it first");
  }
  if (options.twelve_bit) {
    const auto [least, most] = std::ranges::minmax_element(volume.hu);
    if (*least < twelve_bit_intercept || *most > twelve_bit_intercept + 4095) {
      return bad("12 bits hold -1024 to 3071 HU only");
    }
  }
  return {};
}

}  // namespace

Result<void> write_dicom_series(const Volume& volume, const fs::path& folder,
                                const DicomWriteOptions& options) {
  if (const auto checked = check(volume, folder, options); !checked) return checked;
  gdcm::Trace::WarningOff();
  const SeriesWords series{&volume, &options,
                           volume_sha256(volume) + options.patient_name + options.patient_id +
                               options.series_description +
                               fmt::format("{}", options.series_number)};
  const fs::path temporary = folder.string() + ".part";
  std::error_code ignored;
  fs::remove_all(temporary, ignored);
  if (const auto made = make_writable_folder(temporary); !made) return made;
  for (int k = 0; k < volume.grid.size.z(); ++k) {
    const auto bytes = slice_file(series, k);
    auto written = bytes
                       ? write_file_durably(temporary / fmt::format("IM_{:04}.dcm", k + 1), *bytes)
                       : Result<void>(forward(bytes));
    if (!written) {
      fs::remove_all(temporary, ignored);
      return written;
    }
  }
  std::error_code error;
  fs::rename(temporary, folder, error);
  if (error) {
    fs::remove_all(temporary, ignored);
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("can't be written ({})", error.message()));
  }
  return {};
}

}  // namespace skullstation
