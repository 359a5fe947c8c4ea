#include "daemon/evidence/package_source.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>

#include "core/file.h"
#include "core/session/strict_json.h"
#include "daemon/evidence/bag_manifest.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

/// Reads FOLDER/FILE and sees that its "format" is the expected one.
Result<Json> read_json(const fs::path& folder, const char* file, const char* format,
                       const char* maker) {
  const fs::path path = folder / file;
  const std::string advice = fmt::format("give a folder that `skullstation {}` made", maker);
  std::error_code ignored;
  if (!fs::exists(path, ignored)) {
    return fail(ErrorKind::bad_input, folder.string(), fmt::format("holds no {}", file), advice);
  }
  const auto text = read_file(path);
  if (!text) return forward(text);
  const auto json = parse_strict_json(*text, path.string());
  if (!json) return forward(json);
  if (!json->is_object() || !json->contains("format") || (*json)["format"] != format) {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("has not the format \"{}\"", format), advice);
  }
  return Json::parse(*text);
}

/// All ordinary files below `folder`, as data/NAME/...
Result<void> list_files(const fs::path& folder, const std::string& name,
                        std::vector<PayloadFile>& files) {
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::path& path = entry->path();
    if (entry->is_symlink(error) ||
        (!entry->is_regular_file(error) && !entry->is_directory(error))) {
      return fail(ErrorKind::bad_input, path.string(), "is neither a file nor a folder",
                  "put a copy of what it stands for in its place: a package holds bytes, no links");
    }
    const std::string inside = path.lexically_relative(folder).generic_string();
    if (const auto why = unfit_bag_path(inside)) {
      return fail(ErrorKind::bad_input, path.string(), "its name " + *why, "rename it");
    }
    if (entry->is_directory(error)) continue;
    PayloadFile file;
    file.source = path;
    file.bag_path = fmt::format("data/{}/{}", name, inside);
    file.bytes = entry->file_size(error);
    files.push_back(std::move(file));
  }
  if (!error) return {};
  return fail(ErrorKind::bad_input, folder.string(),
              fmt::format("can't be read ({})", error.message()));
}

std::string name_of(const fs::path& folder) {
  const fs::path whole = fs::absolute(folder).lexically_normal();
  return (whole.has_filename() ? whole : whole.parent_path()).filename().string();
}

Result<void> read_numbers(const PackageSource& source, PackageContent& content) {
  content.case_number = source.case_number;
  content.station = source.station;
  if (content.session) {
    const std::string& recorded = content.session->case_number;
    if (content.case_number.empty()) content.case_number = recorded;
    if (!recorded.empty() && content.case_number != recorded) {
      return fail(ErrorKind::bad_input, source.session->string(),
                  fmt::format("is of case \"{}\", not \"{}\"", recorded, content.case_number),
                  "give the session of this case, or leave --case out");
    }
    if (content.station.empty()) content.station = content.session->station;
  }
  if (content.case_number.empty()) content.case_number = name_of(source.case_folder);
  for (const std::string* text : {&content.case_number, &content.station}) {
    if (std::ranges::any_of(*text, [](char c) { return (c >= 0 && c < 32) || c == 127; })) {
      return fail(ErrorKind::bad_input, "--case",
                  "and the station's name must be one line of text");
    }
  }
  return {};
}

Result<void> all_images_there(const Session& session, const fs::path& folder) {
  for (const SessionView& view : session.views) {
    std::error_code ignored;
    if (!fs::is_regular_file(folder / view.image, ignored)) {
      return fail(ErrorKind::bad_input, (folder / view.image).string(),
                  "is missing, and session.json lists it", "bring the photograph back");
    }
  }
  return {};
}

/// The photographs that the reconstruction used are the session's.
Result<void> check_same_photographs(const Session& session, const fs::path& reconstruction) {
  const fs::path path = reconstruction / "cameras.json";
  const auto text = read_file(path);
  if (!text) return forward(text);
  const auto cameras = parse_session(*text, path.string());
  if (!cameras) return forward(cameras);
  for (const SessionView& used : cameras->views) {
    const auto taken = std::ranges::find(session.views, used.image, &SessionView::image);
    if (taken == session.views.end() || taken->sha256 != used.sha256) {
      return fail(
          ErrorKind::bad_input, path.string(),
          fmt::format("was made with {}, which is no photograph of this session", used.image),
          "give the session that was reconstructed, or none");
    }
  }
  return {};
}

/// The session's recorded sums, put to its files.
void add_recorded_sums(const Session& session, std::vector<PayloadFile>& files) {
  std::map<std::string, std::string> recorded;
  for (const SessionView& view : session.views) {
    if (view.sha256) recorded["data/session/" + view.image] = *view.sha256;
  }
  for (PayloadFile& file : files) {
    const auto sum = recorded.find(file.bag_path);
    if (sum != recorded.end()) file.recorded_sha256 = sum->second;
  }
}

}  // namespace

Result<PackageContent> read_package_source(const PackageSource& source) {
  PackageContent content;
  content.program_version = source.program_version;
  auto case_json = read_json(source.case_folder, "case.json", "skullstation-case/1", "approximate");
  if (!case_json) return forward(case_json);
  content.case_json = *std::move(case_json);
  if (const auto listed = list_files(source.case_folder, "case", content.files); !listed) {
    return forward(listed);
  }
  if (source.session) {
    auto session = read_session(*source.session);
    if (!session) return forward(session);
    content.session = *std::move(session);
    if (const auto listed = list_files(*source.session, "session", content.files); !listed) {
      return forward(listed);
    }
    if (const auto there = all_images_there(*content.session, *source.session); !there) {
      return forward(there);
    }
    add_recorded_sums(*content.session, content.files);
  }
  if (source.reconstruction) {
    auto quality = read_json(*source.reconstruction, "quality.json",
                             "skullstation-reconstruction-quality/1", "reconstruct");
    if (!quality) return forward(quality);
    content.reconstruction_quality = *std::move(quality);
    if (const auto listed = list_files(*source.reconstruction, "reconstruction", content.files);
        !listed) {
      return forward(listed);
    }
    if (const auto same = content.session
                              ? check_same_photographs(*content.session, *source.reconstruction)
                              : Result<void>();
        !same) {
      return forward(same);
    }
  }
  if (const auto numbered = read_numbers(source, content); !numbered) return forward(numbered);
  std::ranges::sort(content.files, {}, &PayloadFile::bag_path);
  for (const PayloadFile& file : content.files) content.bytes += file.bytes;
  return content;
}

std::string text_at(const Json& json, const std::string& pointer) {
  const Json::json_pointer place(pointer);
  return json.contains(place) && json[place].is_string() ? json[place].get<std::string>() : "";
}

Result<void> PackageContent::check_links(
    const std::map<std::string, std::string>& sealed_sha256) const {
  for (const PayloadFile& file : files) {
    if (file.recorded_sha256 && sealed_sha256.at(file.bag_path) != *file.recorded_sha256) {
      return fail(ErrorKind::bad_input, file.source.string(),
                  "is not the photograph that was taken: its SHA-256 differs from session.json's",
                  "bring the original back; a changed photograph is not sealed");
    }
  }
  const auto skull = sealed_sha256.find("data/reconstruction/skull.ply");
  const std::string input = text_at(case_json, "/input/sha256");
  if (skull != sealed_sha256.end() && skull->second != input) {
    return fail(ErrorKind::bad_input, text_at(case_json, "/input/file"),
                "the case was made from another skull than the reconstruction's skull.ply (their "
                "SHA-256 differ)",
                "give the reconstruction that the case was made from, or none");
  }
  return {};
}

}  // namespace skullstation
