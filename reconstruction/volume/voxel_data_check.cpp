#include "reconstruction/volume/voxel_data_check.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <memory>
#include <vector>

#include "reconstruction/io/byte_order.h"
#include "reconstruction/io/text_lines.h"
#include "reconstruction/volume/text_header.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t nifti_header_size = 348;
constexpr std::size_t chunk_size = 1 << 20;
constexpr double most_bytes = 1.6e10;
constexpr double most_place = 1e7;  ///< in any unit, of a voxel's size or place

struct GzipCloser {
  void operator()(gzFile_s* file) const { gzclose(file); }
};
using GzipFile = std::unique_ptr<gzFile_s, GzipCloser>;

/// What a NIfTI-1 header says about its data.
struct NiftiLayout {
  std::endian order = std::endian::little;
  std::size_t offset = 0;
  std::size_t size = 0;
  int float_bytes = 0;  ///< 4 or 8 for floating-point voxels, else 0
};

Result<NiftiLayout> layout_of(const std::array<char, nifti_header_size>& header,
                              const std::string& name) {
  NiftiLayout layout;
  const auto read = [&]<class T>(std::size_t at, T) {
    return load_number<T>(header.data() + at, layout.order);
  };
  if (read(0, std::int32_t{}) != 348) layout.order = std::endian::big;
  if (read(0, std::int32_t{}) != 348 || std::string_view(header.data() + 344, 3) != "n+1") {
    return bad_file(name, "byte 0", "not a NIfTI-1 file");
  }
  const int dimensions = read(40, std::int16_t{});
  if (dimensions < 1 || dimensions > 7) {
    return bad_file(name, "byte 40", fmt::format("{} dimensions", dimensions));
  }
  double size = read(72, std::int16_t{}) / 8.0;
  for (int d = 1; d <= dimensions; ++d) {
    const int extent = read(40 + 2 * static_cast<std::size_t>(d), std::int16_t{});
    if (extent < 1) return bad_file(name, fmt::format("byte {}", 40 + 2 * d), "an empty dimension");
    size *= extent;
  }
  const double offset = read(108, 0.0F);
  if (!(offset >= 352.0 && offset < 1e9) || !(size >= 1.0 && size <= most_bytes)) {
    return bad_file(name, "byte 40",
                    fmt::format("claims {:.3g} bytes of voxels at byte {:.0f}, more than any head "
                                "scan has",
                                size, offset));
  }
  // Where the voxels lie: ITK ends the program at a matrix that is not finite.
  const auto is_place = [&](std::size_t first, std::size_t end) -> Result<void> {
    for (std::size_t at = first; at < end; at += sizeof(float)) {
      const double value = read(at, 0.0F);
      if (std::abs(value) <= most_place) continue;
      return bad_file(name, fmt::format("byte {}", at),
                      fmt::format("{} is no size or place of voxels", value));
    }
    return {};
  };
  if (const auto size_of_voxels = is_place(76, 92); !size_of_voxels) return forward(size_of_voxels);
  const bool by_quaternion = read(252, std::int16_t{}) > 0;
  const bool by_matrix = read(254, std::int16_t{}) > 0;
  if (const auto place = is_place(256, by_quaternion ? 280 : 256); !place) return forward(place);
  if (const auto place = is_place(280, by_matrix ? 328 : 280); !place) return forward(place);
  layout.offset = static_cast<std::size_t>(offset);
  layout.size = static_cast<std::size_t>(size);
  const int type = read(70, std::int16_t{});
  layout.float_bytes = type == 16 ? 4 : type == 64 ? 8 : 0;
  return layout;
}

bool is_finite(const char* bytes, const NiftiLayout& layout) {
  return layout.float_bytes == 4 ? std::isfinite(load_number<float>(bytes, layout.order))
                                 : std::isfinite(load_number<double>(bytes, layout.order));
}

/// Bytes that one voxel of a MetaImage takes; 0 if the type is unknown.
std::size_t meta_type_size(const std::string& type) {
  if (type == "MET_CHAR" || type == "MET_UCHAR") return 1;
  if (type == "MET_SHORT" || type == "MET_USHORT") return 2;
  if (type == "MET_INT" || type == "MET_UINT" || type == "MET_FLOAT") return 4;
  if (type == "MET_DOUBLE") return 8;
  return 0;
}

}  // namespace

Result<void> check_nifti_data(const fs::path& path) {
  const std::string name = path.string();
  const GzipFile file(gzopen(path.c_str(), "rb"));  // reads uncompressed files as they are
  if (!file) return bad_file(name, "byte 0", "can't be read");
  std::array<char, nifti_header_size> header{};
  if (gzread(file.get(), header.data(), nifti_header_size) != int{nifti_header_size}) {
    return bad_file(name, "byte 0", "not a NIfTI-1 file, or truncated within its header");
  }
  const auto layout = layout_of(header, name);
  if (!layout) return forward(layout);
  std::vector<char> chunk(chunk_size);
  std::size_t to_skip = layout->offset - nifti_header_size;
  while (to_skip > 0) {
    const int got =
        gzread(file.get(), chunk.data(), static_cast<unsigned>(std::min(to_skip, chunk_size)));
    if (got <= 0) break;
    to_skip -= static_cast<std::size_t>(got);
  }
  std::size_t seen = 0;
  while (seen < layout->size) {
    const int got = gzread(file.get(), chunk.data(),
                           static_cast<unsigned>(std::min(layout->size - seen, chunk_size)));
    if (got <= 0) {
      return bad_file(name, fmt::format("byte {}", layout->offset + seen),
                      fmt::format("the file ends or is damaged after {} of the {} bytes of voxels "
                                  "that its header claims",
                                  seen, layout->size));
    }
    const auto step = static_cast<std::size_t>(layout->float_bytes);
    for (std::size_t i = 0; step > 0 && i + step <= static_cast<std::size_t>(got); i += step) {
      if (is_finite(chunk.data() + i, *layout)) continue;
      return bad_file(name, fmt::format("byte {}", layout->offset + seen + i),
                      fmt::format("voxel {} is not finite", (seen + i) / step));
    }
    seen += static_cast<std::size_t>(got);
  }
  return {};
}

Result<void> check_meta_image_data(const fs::path& path) {
  const std::string name = path.string();
  const TextHeader header = read_text_header(path, '=');
  // Before ITK, which reads as many numbers as the header says the space has dimensions.
  if (int dimensions = 0;
      !parse_number(std::string_view(header.first_word("NDims")), dimensions) || dimensions != 3) {
    return bad_file(name, "header",
                    fmt::format("NDims is \"{}\", not 3", header.first_word("NDims")));
  }
  const std::string data_file = header.first_word("ElementDataFile");
  if (data_file.empty()) return bad_file(name, "header", "ElementDataFile is missing");
  double size = static_cast<double>(meta_type_size(header.first_word("ElementType")));
  if (size == 0.0) return bad_file(name, "header", "ElementType is missing or none of a CT");
  const std::string extents = header.value("DimSize");  // the words are views into it
  for (const std::string_view word : words_of(extents)) {
    int extent = 0;
    if (!parse_number(word, extent) || extent < 1) {
      return bad_file(name, "header", "DimSize is not whole numbers");
    }
    size *= extent;
  }
  if (header.first_word("CompressedData") == "True") {
    parse_number(std::string_view(header.first_word("CompressedDataSize")), size);
  }
  const bool local = data_file == "LOCAL" || data_file == "Local" || data_file == "local";
  const fs::path data_path = local ? path : path.parent_path() / data_file;
  std::error_code error;
  const auto file_size = fs::file_size(data_path, error);
  if (error) return bad_file(name, "header", fmt::format("{} can't be read", data_path.string()));
  const double there =
      static_cast<double>(file_size) - (local ? static_cast<double>(header.size) : 0.0);
  if (there < size) {
    return bad_file(
        name, fmt::format("byte {}", file_size),
        fmt::format("the data are {:.0f} bytes; the header claims {:.0f}", there, size));
  }
  return {};
}

}  // namespace skullstation
