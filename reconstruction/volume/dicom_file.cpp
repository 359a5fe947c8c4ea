#include "reconstruction/volume/dicom_file.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "core/file.h"
#include "reconstruction/io/byte_order.h"
#include "reconstruction/io/text_lines.h"
#include "reconstruction/volume/dicom_elements.h"
#include "reconstruction/volume/dicom_pixels.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

// The tags of PS3.6 that matter here.
constexpr DicomTag image_type = 0x00080008;
constexpr DicomTag sop_class_uid = 0x00080016;
constexpr DicomTag study_date = 0x00080020;
constexpr DicomTag modality = 0x00080060;
constexpr DicomTag manufacturer = 0x00080070;
constexpr DicomTag series_description = 0x0008103e;
constexpr DicomTag manufacturer_model = 0x00081090;
constexpr DicomTag frame_type = 0x00089007;
constexpr DicomTag patient_name = 0x00100010;
constexpr DicomTag patient_id = 0x00100020;
constexpr DicomTag birth_date = 0x00100030;
constexpr DicomTag patient_sex = 0x00100040;
constexpr DicomTag patient_age = 0x00101010;
constexpr DicomTag slice_thickness = 0x00180050;
constexpr DicomTag kvp = 0x00180060;
constexpr DicomTag convolution_kernel = 0x00181210;
constexpr DicomTag ct_frame_type_sequence = 0x00189329;
constexpr DicomTag study_uid = 0x0020000d;
constexpr DicomTag series_uid = 0x0020000e;
constexpr DicomTag series_number = 0x00200011;
constexpr DicomTag image_position = 0x00200032;
constexpr DicomTag image_orientation = 0x00200037;
constexpr DicomTag plane_position_sequence = 0x00209113;
constexpr DicomTag plane_orientation_sequence = 0x00209116;
constexpr DicomTag samples_per_pixel = 0x00280002;
constexpr DicomTag photometric = 0x00280004;
constexpr DicomTag number_of_frames = 0x00280008;
constexpr DicomTag rows = 0x00280010;
constexpr DicomTag columns = 0x00280011;
constexpr DicomTag pixel_spacing = 0x00280030;
constexpr DicomTag bits_allocated = 0x00280100;
constexpr DicomTag bits_stored = 0x00280101;
constexpr DicomTag high_bit = 0x00280102;
constexpr DicomTag pixel_representation = 0x00280103;
constexpr DicomTag rescale_intercept = 0x00281052;
constexpr DicomTag rescale_slope = 0x00281053;
constexpr DicomTag rescale_type = 0x00281054;
constexpr DicomTag pixel_measures_sequence = 0x00289110;
constexpr DicomTag pixel_value_transformation_sequence = 0x00289145;
constexpr DicomTag shared_functional_groups = 0x52009229;
constexpr DicomTag per_frame_functional_groups = 0x52009230;

constexpr double most_pixels = 2e9;

tl::unexpected<Error> bad(const fs::path& path, std::string what, std::string advice = {}) {
  return fail(ErrorKind::bad_input, path.string(), std::move(what), std::move(advice));
}

bool is_localizer(const std::string& type) { return type.find("LOCALIZER") != std::string::npos; }

/// Takes over what `data` says about a frame; called with a plain image's whole data set, or with
/// the functional groups of an enhanced one.
void read_plane(const DicomDataSet& data, DicomFrame& frame) {
  if (const auto position = data.decimals(image_position, 3)) {
    frame.position_mm = Eigen::Vector3d(position->data());
  }
  if (const auto cosines = data.decimals(image_orientation, 6)) {
    frame.row_direction = Eigen::Vector3d(cosines->data());
    frame.column_direction = Eigen::Vector3d(cosines->data() + 3);
  }
  // The file's order is: between rows (along j), between columns (along i).
  if (const auto spacing = data.decimals(pixel_spacing, 2)) {
    frame.pixel_spacing_mm = {(*spacing)[1], (*spacing)[0]};
  }
  if (const auto slope = data.decimal(rescale_slope)) frame.slope = slope;
  if (const auto intercept = data.decimal(rescale_intercept)) frame.intercept = intercept;
  const std::string type = data.text(rescale_type);
  if (!type.empty()) frame.rescale_type = type;
}

/// The macros of Enhanced CT that a slice's place and values hang on (PS3.3 C.7.6.16).
void read_functional_groups(const DicomDataSet& groups, DicomFrame& frame) {
  for (const DicomTag macro : {plane_position_sequence, plane_orientation_sequence,
                               pixel_measures_sequence, pixel_value_transformation_sequence}) {
    for (const DicomDataSet& item : groups.items(macro)) read_plane(item, frame);
  }
  for (const DicomDataSet& item : groups.items(ct_frame_type_sequence)) {
    frame.is_localizer = is_localizer(item.text(frame_type));
  }
}

std::vector<DicomFrame> read_frames(const DicomDataSet& data) {
  DicomFrame common;
  read_plane(data, common);
  common.is_localizer = is_localizer(data.text(image_type));
  const auto& per_frame = data.items(per_frame_functional_groups);
  if (per_frame.empty()) return {common};
  for (const DicomDataSet& shared : data.items(shared_functional_groups)) {
    read_functional_groups(shared, common);
  }
  std::vector<DicomFrame> frames;
  for (const DicomDataSet& groups : per_frame) {
    frames.push_back(common);
    read_functional_groups(groups, frames.back());
  }
  return frames;
}

/// Empty if the frame has a place, unit vectors at right angles and a scale.
std::string defect_of(const DicomFrame& frame) {
  if (!frame.position_mm) return "Image Position (Patient) is missing or not three numbers";
  const Eigen::Vector3d& row = frame.row_direction;
  const Eigen::Vector3d& column = frame.column_direction;
  if (!(std::abs(row.norm() - 1.0) < 1e-3) || !(std::abs(column.norm() - 1.0) < 1e-3) ||
      !(std::abs(row.dot(column)) < 1e-3)) {
    return "Image Orientation (Patient) is missing or not two unit vectors at right angles";
  }
  if (!(frame.pixel_spacing_mm.minCoeff() > 0.0)) {
    return "Pixel Spacing is missing or not two lengths";
  }
  if (!frame.slope || !frame.intercept) {
    return "Rescale Slope and Intercept are missing: its values are not in Hounsfield units";
  }
  if (*frame.slope == 0.0) return "Rescale Slope is 0";
  if (!frame.rescale_type.empty() && frame.rescale_type != "HU") {
    return fmt::format("its values are in \"{}\", not Hounsfield units", frame.rescale_type);
  }
  return {};
}

/// "061Y", "018M", "003W", "010D" (PS3.5 section 6.2, AS).
std::optional<int> years_of(const std::string& age) {
  int number = 0;
  if (age.size() != 4 || !parse_number(std::string_view(age).substr(0, 3), number)) {
    return std::nullopt;
  }
  switch (age[3]) {
    case 'Y': return number;
    case 'M': return number / 12;
    case 'W': return number / 52;
    case 'D': return number / 365;
    default: return std::nullopt;
  }
}

void read_words(const DicomDataSet& data, DicomImage& image) {
  image.modality = data.text(modality);
  image.sop_class_uid = data.text(sop_class_uid);
  image.series_uid = data.text(series_uid);
  image.series_number = data.text(series_number);
  image.series_description = data.text(series_description);
  image.info.format = "DICOM";
  image.info.manufacturer = data.text(manufacturer);
  image.info.scanner_model = data.text(manufacturer_model);
  image.info.convolution_kernel = data.text(convolution_kernel);
  image.info.tube_voltage_kv = data.decimal(kvp);
  image.info.slice_thickness_mm = data.decimal(slice_thickness);
  image.info.sex = data.text(patient_sex);
  image.info.age_years = years_of(data.text(patient_age));
  image.identity = {data.text(patient_name), data.text(patient_id), data.text(birth_date),
                    data.text(study_date),   data.text(study_uid),  image.series_uid,
                    image.series_description};
}

Result<void> read_pixel_layout(const DicomDataSet& data, DicomImage& image) {
  const int allocated = data.number(bits_allocated).value_or(0);
  const int stored = data.number(bits_stored).value_or(allocated);
  const int highest = data.number(high_bit).value_or(stored - 1);
  if (data.number(samples_per_pixel).value_or(1) != 1 || data.text(photometric) != "MONOCHROME2" ||
      allocated != 16 || stored < 1 || highest >= 16 || highest + 1 < stored) {
    return bad(image.path, "its pixels are not grey values (MONOCHROME2) of up to 16 bits");
  }
  image.bits = {highest + 1, stored, data.number(pixel_representation).value_or(0) == 1};
  const double pixels =
      static_cast<double>(image.rows) * image.columns * static_cast<double>(image.frames.size());
  if (pixels > most_pixels) return bad(image.path, fmt::format("claims {:.3g} pixels", pixels));
  return {};
}

Result<std::optional<DicomImage>> image_of(const DicomFile& file, const fs::path& path) {
  const DicomDataSet& data = file.data;
  DicomImage image;
  image.path = path;
  image.rows = data.number(rows).value_or(0);
  image.columns = data.number(columns).value_or(0);
  if (image.rows == 0 || image.columns == 0) return std::nullopt;
  read_words(data, image);
  if (!image.is_ct_image()) return image;
  image.frames = read_frames(data);
  const double frame_count = data.decimal(number_of_frames).value_or(1.0);
  if (frame_count != static_cast<double>(image.frames.size())) {
    return bad(path, fmt::format("holds {} frames, and the places of {}", frame_count,
                                 image.frames.size()));
  }
  if (const auto read = read_pixel_layout(data, image); !read) return forward(read);
  for (std::size_t i = 0; i < image.frames.size(); ++i) {
    if (image.frames[i].is_localizer) continue;
    const std::string defect = defect_of(image.frames[i]);
    if (!defect.empty()) return bad(path, fmt::format("frame {}: {}", i + 1, defect));
  }
  return image;
}

}  // namespace

bool DicomImage::is_ct_image() const {
  constexpr std::string_view ct_image_storage = "1.2.840.10008.5.1.4.1.1.2";
  return modality == "CT" && (sop_class_uid == ct_image_storage ||
                              sop_class_uid == std::string(ct_image_storage) + ".1" ||
                              sop_class_uid == std::string(ct_image_storage) + ".2");
}

int DicomImage::StoredBits::value(std::uint16_t raw) const {
  const auto up = static_cast<std::uint16_t>(raw << (16 - top));
  const int down = 16 - count;
  return is_signed ? static_cast<std::int16_t>(up) >> down : up >> down;
}

Result<std::optional<DicomImage>> read_dicom_header(const fs::path& path) {
  const auto bytes = read_file(path);
  if (!bytes) return forward(bytes);
  if (!has_dicom_preamble(*bytes)) return std::nullopt;
  const auto file = parse_dicom(*bytes, path.string());
  if (!file) return forward(file);
  return image_of(*file, path);
}

Result<DecodedFrames> decode_dicom_frames(const DicomImage& image) {
  const auto bytes = read_file(image.path);
  if (!bytes) return forward(bytes);
  const auto file = parse_dicom(*bytes, image.path.string());
  if (!file) return forward(file);
  const std::size_t frame_size =
      static_cast<std::size_t>(image.rows) * static_cast<std::size_t>(image.columns);
  const std::size_t count = frame_size * image.frames.size();
  std::string decompressed;
  std::string_view pixels = file->data.bytes(DicomFile::pixel_data).value_or("");
  if (file->encapsulated_pixels) {
    auto result = decompress_dicom_pixels(*bytes, file->transfer_syntax_uid, image.path.string());
    if (!result) return forward(result);
    decompressed = std::move(*result);
    pixels = decompressed;
  }
  if (pixels.size() / 2 < count) {
    return bad(
        image.path,
        fmt::format("its pixel data are {} bytes; {} frames of {} x {} pixels take {}",
                    pixels.size(), image.frames.size(), image.columns, image.rows, 2 * count),
        "copy the series again");
  }
  DecodedFrames decoded;
  decoded.hu.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const DicomFrame& frame = image.frames[i / frame_size];
    const auto raw = load_number<std::uint16_t>(pixels.data() + 2 * i, std::endian::little);
    const double hu =
        frame.slope.value_or(1.0) * image.bits.value(raw) + frame.intercept.value_or(0.0);
    const double held = std::clamp(hu, double(std::numeric_limits<std::int16_t>::min()),
                                   double(std::numeric_limits<std::int16_t>::max()));
    if (held != hu) ++decoded.cut_off;
    decoded.hu[i] = static_cast<std::int16_t>(std::lround(held));
  }
  return decoded;
}

}  // namespace skullstation
