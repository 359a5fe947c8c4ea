#include "daemon/exhibit/exhibit.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>

#include "core/file.h"
#include "core/session/image_file.h"
#include "core/session/strict_json.h"
#include "core/staged_folder.h"
#include "core/url_path.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/package_check.h"
#include "daemon/exhibit/exhibit_parts.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using nlohmann::json;

/// Only what is as it was sealed is shown.
Result<PackageCheck> checked(const fs::path& package, const Progress& progress) {
  auto check = check_package(package, {}, progress);
  if (!check || check->findings.empty()) return check;
  const PackageFinding& first = check->findings.front();
  return fail(ErrorKind::bad_input, package.string(),
              fmt::format("is not as it was sealed ({}: {})", first.file, first.what),
              "`skullstation verify` tells more; take a sound copy of it");
}

/// The sealed case.json. Its seals say who sealed it, not that it is what `approximate` writes.
Result<json> read_record(const fs::path& file) {
  const auto text = read_file(file);
  if (!text) return forward(text);
  auto record = parse_strict_json(*text, file.string());
  if (!record) return record;
  const auto no_case = [&](const char* what) {
    return fail(ErrorKind::bad_input, file.string(), what,
                "exhibit a package of a case that `skullstation approximate` made");
  };
  if (!record->is_object()) return no_case("is no JSON object");
  if (record->contains("model") && !(*record)["model"].is_object()) {
    return no_case("has a \"model\" that is no JSON object");
  }
  return record;
}

std::vector<std::string> texts_at(const json& record, const char* key) {
  std::vector<std::string> texts;
  for (const json& text : record.value(key, json::array())) {
    if (text.is_string()) texts.push_back(text);
  }
  return texts;
}

/// The case's `anatomical_from_input`, from our axes [mm] to glTF's (x, z, -y), still in mm.
std::optional<json> scene_from_skull(const json& record) {
  const json rows = record.value("anatomical_from_input", json());
  Eigen::Matrix4d ours = Eigen::Matrix4d::Identity();
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) {
      const auto place = json::json_pointer(fmt::format("/{}/{}", r, c));
      if (!rows.contains(place) || !rows[place].is_number()) return std::nullopt;
      ours(r, c) = rows[place].get<double>();
    }
  }
  Eigen::Matrix4d gltf_from_ours = Eigen::Matrix4d::Zero();
  gltf_from_ours << 1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1;
  const Eigen::Matrix4d turned = gltf_from_ours * ours * gltf_from_ours.transpose();
  json matrix = json::array();
  for (int r = 0; r < 4; ++r) {
    matrix.push_back({turned(r, 0), turned(r, 1), turned(r, 2), turned(r, 3)});
  }
  return matrix;
}

/// XMP as KHR_xmp_json_ld has it (Khronos, glTF 2.0 extension): what libraries and museums read.
json xmp_packet(const Exhibit& exhibit, const std::string& title) {
  const auto in_english = [](const std::string& text) -> json {
    return {{"@type", "rdf:Alt"}, {"rdf:_1", {{"@language", "en"}, {"@value", text}}}};
  };
  json packet = {{"@context",
                  {{"dc", "http://purl.org/dc/elements/1.1/"},
                   {"rdf", "http://www.w3.org/1999/02/22-rdf-syntax-ns#"},
                   {"xmp", "http://ns.adobe.com/xap/1.0/"},
                   {"xmpRights", "http://ns.adobe.com/xap/1.0/rights/"}}},
                 {"@id", ""},
                 {"dc:title", in_english(fmt::format("{}: {}", exhibit.title, title))},
                 {"dc:identifier", exhibit.case_number},
                 {"dc:creator", {{"@list", {exhibit.station}}}},
                 {"dc:format", "model/gltf-binary"},
                 {"xmp:CreatorTool", exhibit.made_by}};
  if (!exhibit.label.holder.empty()) {
    packet["xmpRights:Owner"] = {{"@set", {exhibit.label.holder}}};
  }
  if (!exhibit.label.rights.empty()) packet["dc:rights"] = in_english(exhibit.label.rights);
  if (!exhibit.label.rights_url.empty()) {
    packet["xmpRights:WebStatement"] = exhibit.label.rights_url;
  }
  return packet;
}

void describe(json& gltf, const Exhibit& exhibit, const std::string& title) {
  gltf["extensionsUsed"].push_back("KHR_xmp_json_ld");
  gltf["extensions"]["KHR_xmp_json_ld"]["packets"] = json::array({xmp_packet(exhibit, title)});
  json& asset = gltf["asset"];
  asset["extensions"]["KHR_xmp_json_ld"]["packet"] = 0;
  asset["generator"] = exhibit.made_by;
  if (!exhibit.label.rights.empty()) asset["copyright"] = exhibit.label.rights;
  asset["extras"] = {{"case", exhibit.case_number},
                     {"station", exhibit.station},
                     {"title", title},
                     {"units", "metre"},
                     {"package_sha256", exhibit.package_sha256},
                     {"institution", exhibit.label.holder},
                     {"licence", exhibit.label.rights_url},
                     {"warnings", exhibit.warnings}};
}

/// Copies a model with its description into the folder.
Result<void> add_model(const fs::path& file, ExhibitModel model, const StagedFolder& staged,
                       Exhibit& exhibit) {
  const auto bytes = read_file(file);
  if (!bytes) return forward(bytes);
  auto container = split_glb(*bytes, file.string());
  if (!container) return forward(container);
  const auto extent = glb_extent(container->gltf, file.string());
  if (!extent) return forward(extent);
  try {
    describe(container->gltf, exhibit, model.title);
  } catch (const json::exception& error) {  // its "asset" is a list, say
    return no_glb(file.string(), error.what());
  }
  const std::string described = join_glb(*container);
  model.bytes = described.size();
  model.extent = *extent;
  if (auto written = write_file_durably(staged / model.file, described); !written) return written;
  exhibit.models.push_back(std::move(model));
  return {};
}

/// "preview_three-quarter.png": "three-quarter"
Result<void> add_pictures(const fs::path& case_folder, const StagedFolder& staged,
                          Exhibit& exhibit) {
  constexpr std::string_view prefix = "preview_";
  std::vector<fs::path> files;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(case_folder, error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(prefix) && name.ends_with(".png")) files.push_back(entry.path());
  }
  std::ranges::sort(files);
  for (const fs::path& file : files) {
    const auto bytes = read_file(file);
    if (!bytes) return forward(bytes);
    const auto image = decode_image(*bytes, file.string());
    if (!image) return forward(image);
    const std::string name = file.filename().string();
    if (auto written = write_file_durably(staged / name, *bytes); !written) return written;
    std::string title = file.stem().string().substr(prefix.size());
    std::ranges::replace(title, '_', ' ');
    exhibit.pictures.push_back({name, title, image->width, image->height});
  }
  return {};
}

/// The folder's own name below the configured address.
std::string address_of(const std::string& base, const fs::path& out) {
  const fs::path whole = fs::absolute(out).lexically_normal();
  const fs::path name = whole.has_filename() ? whole.filename() : whole.parent_path().filename();
  return fmt::format("{}{}{}", base, base.ends_with('/') ? "" : "/", url_path(name.string()));
}

std::string text_of(const nlohmann::ordered_json& document) {
  return document.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace

Result<std::vector<std::string>> write_exhibit(const fs::path& package, const ExhibitLabel& label,
                                               const std::string& program_version,
                                               const fs::path& out, const Progress& progress) {
  if (auto free = check_new_folder(out); !free) return forward(free);
  const auto check = checked(package, progress.part(0.0, 0.7));
  if (!check) return forward(check);
  const fs::path case_folder = package / "data/case";
  const auto read = read_record(case_folder / "case.json");
  if (!read) return forward(read);
  const json& record = *read;
  const auto sum = sha256_of_file(package / tag_manifest_file);
  if (!sum) return forward(sum);

  Exhibit exhibit;
  exhibit.label = label;
  if (!label.base_url.empty()) exhibit.address = address_of(label.base_url, out);
  exhibit.case_number = check->case_number;
  exhibit.title = fmt::format("Case {}: skull and facial approximation", check->case_number);
  exhibit.station = check->station;
  exhibit.made_by = "skullstation " + program_version;
  exhibit.package_sha256 = *sum;
  exhibit.warnings = texts_at(record, "warnings");
  if (record.contains("model") && record["model"].value("card", json()).is_string()) {
    exhibit.warnings.push_back(record["model"]["card"]);
  }

  StagedFolder staged(out);
  if (auto made = staged.make(); !made) return forward(made);
  const fs::path skull = package / "data/reconstruction/skull.glb";
  if (fs::exists(skull)) {
    if (auto added =
            add_model(skull, {"skull.glb", "Skull as scanned", 0, {}, scene_from_skull(record)},
                      staged, exhibit);
        !added) {
      return forward(added);
    }
  }
  if (auto added =
          add_model(case_folder / "head.glb",
                    {"head.glb", "Facial approximation", 0, {}, std::nullopt}, staged, exhibit);
      !added) {
    return forward(added);
  }
  if (auto added = add_pictures(case_folder, staged, exhibit); !added) return forward(added);
  std::vector<std::string> files;
  for (const ExhibitModel& model : exhibit.models) files.push_back(model.file);
  for (const ExhibitPicture& picture : exhibit.pictures) files.push_back(picture.file);
  files.emplace_back("scene.svx.json");
  if (auto written = write_file_durably(staged / files.back(), text_of(voyager_scene(exhibit)));
      !written) {
    return forward(written);
  }
  if (!label.base_url.empty()) {
    files.emplace_back("manifest.json");
    if (auto written = write_file_durably(staged / files.back(), text_of(iiif_manifest(exhibit)));
        !written) {
      return forward(written);
    }
  }
  if (auto placed = staged.put_in_place(); !placed) return forward(placed);
  return files;
}

}  // namespace skullstation
