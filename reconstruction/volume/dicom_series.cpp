#include "reconstruction/volume/dicom_series.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <set>

#include "reconstruction/volume/dicom_file.h"
#include "reconstruction/volume/slice_stack.h"
#include "reconstruction/volume/stack_resampling.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using Series = std::vector<DicomImage>;

constexpr std::size_t most_voxels = 2'000'000'000;

Result<std::vector<fs::path>> files_below(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (fs::recursive_directory_iterator entry(folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->is_regular_file()) files.push_back(entry->path());
  }
  if (error) {
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("can't be read ({})", error.message()));
  }
  std::ranges::sort(files);
  return files;
}

struct FolderContent {
  std::map<std::string, Series> ct_series;  // by UID
  std::set<std::string> other_modalities;
  std::size_t left_out = 0;  // files that are no CT images
};

Result<FolderContent> read_headers(const fs::path& folder, const Progress& progress) {
  const auto files = files_below(folder);
  if (!files) return forward(files);
  FolderContent content;
  for (std::size_t i = 0; i < files->size(); ++i) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, folder.string(), "reading was cancelled");
    }
    progress.report(static_cast<double>(i) / static_cast<double>(files->size()), "reading headers");
    auto image = read_dicom_header((*files)[i]);
    if (!image) return forward(image);
    if (*image && (*image)->is_ct_image()) {
      content.ct_series[(*image)->series_uid].push_back(std::move(**image));
      continue;
    }
    ++content.left_out;
    if (*image) content.other_modalities.insert((*image)->modality);
  }
  return content;
}

std::size_t slice_count(const Series& series) {
  std::size_t count = 0;
  for (const DicomImage& image : series) count += image.frames.size();
  return count;
}

std::string listed(const std::map<std::string, Series>& all) {
  std::string text;
  for (const auto& [uid, series] : all) {
    text += fmt::format("{}number {} \"{}\" ({} slices)", text.empty() ? "" : ", ",
                        series[0].series_number, series[0].series_description, slice_count(series));
  }
  return text;
}

Result<Series> choose(const FolderContent& content, const fs::path& folder,
                      const std::string& wanted) {
  const auto& all = content.ct_series;
  if (all.empty()) {
    std::string modalities;
    for (const std::string& modality : content.other_modalities) modalities += " " + modality;
    return fail(ErrorKind::bad_input, folder.string(),
                modalities.empty() ? "holds no DICOM images"
                                   : fmt::format("holds no CT images, but modality{}", modalities));
  }
  std::vector<const Series*> matching;
  for (const auto& [uid, series] : all) {
    if (wanted.empty() || wanted == uid || wanted == series[0].series_number ||
        wanted == series[0].series_description) {
      matching.push_back(&series);
    }
  }
  if (matching.size() == 1) return *matching[0];
  return fail(ErrorKind::bad_input, folder.string(),
              matching.empty()
                  ? fmt::format("holds no series \"{}\"; there are: {}", wanted, listed(all))
                  : fmt::format("holds {} CT series: {}", matching.size(), listed(all)),
              "choose one by its number, description or UID (--series)");
}

/// A slice and where its pixels come from.
struct Slice {
  const DicomImage* image = nullptr;
  std::size_t frame = 0;

  const DicomFrame& plane() const { return image->frames[frame]; }
  std::string name() const {
    const std::string file = image->path.string();
    return image->frames.size() == 1 ? file : fmt::format("{} frame {}", file, frame + 1);
  }
};

Result<void> check_alike(const Slice& slice, const Slice& first) {
  const auto differs = [&](const char* what) {
    return fail(ErrorKind::bad_input, slice.name(),
                fmt::format("has another {} than {} of the same series", what, first.name()),
                "leave only slices of one scan in the folder");
  };
  const DicomFrame& a = slice.plane();
  const DicomFrame& b = first.plane();
  if (slice.image->rows != first.image->rows || slice.image->columns != first.image->columns) {
    return differs("number of rows or columns");
  }
  if ((a.pixel_spacing_mm - b.pixel_spacing_mm).norm() > 1e-4) return differs("pixel spacing");
  if ((a.row_direction - b.row_direction).norm() > 1e-3 ||
      (a.column_direction - b.column_direction).norm() > 1e-3) {
    return differs("orientation");
  }
  return {};
}

struct SliceSet {
  std::vector<Slice> slices;
  std::size_t localizers = 0;
};

Result<SliceSet> slices_of(const Series& series) {
  SliceSet set;
  for (const DicomImage& image : series) {
    for (std::size_t frame = 0; frame < image.frames.size(); ++frame) {
      if (image.frames[frame].is_localizer) {
        ++set.localizers;
      } else {
        set.slices.push_back({&image, frame});
      }
    }
  }
  for (const Slice& slice : set.slices) {
    if (const auto alike = check_alike(slice, set.slices[0]); !alike) return forward(alike);
  }
  return set;
}

Result<SliceStack> stack_of(const std::vector<Slice>& slices) {
  std::vector<SlicePlace> places;
  for (const Slice& slice : slices) {
    places.push_back({*slice.plane().position_mm, slice.name()});
  }
  const DicomFrame& first = slices[0].plane();
  return stack_slices(places, first.row_direction, first.column_direction);
}

/// Reads each file once and puts its frames where they belong.
Result<std::size_t> fill(Volume& volume, const Series& series, const std::vector<Slice>& slices,
                         const SliceStack& stack, const Progress& progress) {
  const std::size_t slice_size = static_cast<std::size_t>(volume.grid.size.x()) *
                                 static_cast<std::size_t>(volume.grid.size.y());
  std::map<const DicomImage*, std::vector<std::pair<std::size_t, std::size_t>>> goes_to;
  for (std::size_t k = 0; k < stack.order.size(); ++k) {
    const Slice& slice = slices[static_cast<std::size_t>(stack.order[k])];
    goes_to[slice.image].emplace_back(slice.frame, k);
  }
  std::size_t cut_off = 0;
  for (std::size_t i = 0; i < series.size(); ++i) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, series[i].path.string(), "reading was cancelled");
    }
    progress.report(static_cast<double>(i) / static_cast<double>(series.size()), "reading slices");
    const auto targets = goes_to.find(&series[i]);
    if (targets == goes_to.end()) continue;
    const auto decoded = decode_dicom_frames(series[i]);
    if (!decoded) return forward(decoded);
    cut_off += decoded->cut_off;
    for (const auto& [frame, k] : targets->second) {
      std::copy_n(decoded->hu.begin() + static_cast<std::ptrdiff_t>(frame * slice_size), slice_size,
                  volume.hu.begin() + static_cast<std::ptrdiff_t>(k * slice_size));
    }
  }
  return cut_off;
}

Result<Volume> assemble(const Series& series, const VolumeReadOptions& options,
                        const Progress& progress) {
  const auto set = slices_of(series);
  if (!set) return forward(set);
  const auto& slices = set->slices;
  if (slices.empty()) {
    return fail(ErrorKind::bad_input, series[0].path.string(), "its series holds localizers only");
  }
  const auto stack = stack_of(slices);
  if (!stack) return forward(stack);

  const Slice& lowest = slices[static_cast<std::size_t>(stack->order.front())];
  const DicomFrame& plane = lowest.plane();
  Volume volume;
  volume.info = lowest.image->info;
  if (options.keep_identity) volume.info.identity = lowest.image->identity;
  volume.grid.size = {lowest.image->columns, lowest.image->rows, static_cast<int>(slices.size())};
  volume.grid.spacing_mm << plane.pixel_spacing_mm, stack->spacing_mm;
  volume.grid.origin_mm = *plane.position_mm;
  const Eigen::Vector3d row = plane.row_direction.normalized();
  const Eigen::Vector3d normal = row.cross(plane.column_direction).normalized();
  volume.grid.direction << row, normal.cross(row), normal;
  if (volume.grid.count() > most_voxels) {
    return fail(ErrorKind::bad_input, series[0].path.string(),
                fmt::format("its series claims {} voxels, more than any head scan has",
                            volume.grid.count()));
  }
  volume.hu.resize(volume.grid.count());
  const auto cut_off = fill(volume, series, slices, *stack, progress);
  if (!cut_off) return forward(cut_off);

  const auto warn = [&](std::string sentence) {
    volume.info.warnings.push_back(std::move(sentence));
  };
  if (set->localizers > 0) {
    warn(fmt::format("{} localizer images were left out", set->localizers));
  }
  if (*cut_off > 0) {
    warn(fmt::format("{} voxels lie beyond what 16 bits hold and were cut off", *cut_off));
  }
  if (stack->tilt_deg > 0.0) {
    volume = straightened(volume, *stack);
    warn(fmt::format("the gantry was tilted by {:.1f} degrees; the slices were shifted back",
                     stack->tilt_deg));
  }
  if (stack->uneven) {
    volume = evenly_spaced(volume, *stack);
    warn(fmt::format("slices lie {:.2f} to {:.2f} mm apart; they were interpolated at {:.2f} mm",
                     stack->smallest_gap_mm, stack->largest_gap_mm, stack->smallest_gap_mm));
  }
  return volume;
}

}  // namespace

bool is_dicom_file(const fs::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<char, 132> start{};
  in.read(start.data(), start.size());
  return in && std::string_view(start.data() + 128, 4) == "DICM";
}

Result<Volume> read_dicom_series(const fs::path& path, const VolumeReadOptions& options,
                                 const Progress& progress) {
  std::string wanted = options.series;
  fs::path folder = path;
  if (!fs::is_directory(path)) {
    auto image = read_dicom_header(path);
    if (!image) return forward(image);
    if (!*image) return fail(ErrorKind::bad_input, path.string(), "is not a DICOM image");
    if (!(*image)->is_ct_image()) {
      return fail(ErrorKind::bad_input, path.string(),
                  fmt::format("is no CT image, but modality {}", (*image)->modality));
    }
    if ((*image)->frames.size() > 1) {
      return assemble({std::move(**image)}, options, progress);
    }
    wanted = (*image)->series_uid;
    folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  }
  const auto content = read_headers(folder, progress.part(0.0, 0.3));
  if (!content) return forward(content);
  const auto series = choose(*content, folder, wanted);
  if (!series) return forward(series);
  auto volume = assemble(*series, options, progress.part(0.3, 1.0));
  if (volume && content->left_out > 0) {
    volume->info.warnings.push_back(fmt::format("{} files in {} are no CT images and were left out",
                                                content->left_out, folder.string()));
  }
  return volume;
}

}  // namespace skullstation
