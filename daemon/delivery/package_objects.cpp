#include "daemon/delivery/package_objects.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/delivery/dicom_objects.h"
#include "daemon/delivery/fhir_bundle.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/package_source.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

tl::unexpected<Error> no_package(const fs::path& folder, const Error& reason) {
  return fail(ErrorKind::bad_input, folder.string(),
              fmt::format("is no sealed package ({})", reason.message()),
              "`skullstation package` makes one");
}

Result<std::vector<DeliveryObject>> files_of(const SealedPackage& package) {
  std::vector<DeliveryObject> objects;
  for (const ManifestLine& line : package.files) {
    const fs::path file = package.folder / line.path;
    std::error_code error;
    const auto bytes = fs::file_size(file, error);
    if (error) {
      return fail(ErrorKind::bad_input, file.string(), "is missing in the package",
                  fmt::format("`skullstation verify {}` says what is wrong with it; put back a "
                              "sound copy, then retry",
                              package.folder.string()));
    }
    objects.push_back({package.remote_name() + "/" + line.path, file, bytes, line.sha256});
  }
  return objects;
}

bool holds_files(DeliveryProtocol protocol) {
  return protocol == DeliveryProtocol::folder || protocol == DeliveryProtocol::webdav ||
         protocol == DeliveryProtocol::s3 || protocol == DeliveryProtocol::sftp;
}

}  // namespace

std::string SealedPackage::remote_name() const {
  std::string name;
  for (const unsigned char c : case_number) {
    const bool plain = std::isalnum(c) != 0 || c == '-' || c == '.';
    name += plain ? static_cast<char>(c) : '_';
  }
  if (name.empty() || name.front() == '.') name.insert(0, "case");
  return fmt::format("{}_{}", name.substr(0, 80), sha256.substr(0, 16));
}

Result<SealedPackage> read_sealed_package(const fs::path& folder) {
  SealedPackage package;
  std::error_code error;
  package.folder = fs::absolute(folder, error).lexically_normal();
  if (package.folder.filename().empty()) package.folder = package.folder.parent_path();
  std::string manifests;
  for (const char* name : {manifest_file, tag_manifest_file, signature_sums_file}) {
    const auto text = read_file(package.folder / name);
    if (!text) return no_package(package.folder, text.error());
    const auto lines = parse_manifest(*text, name);
    if (!lines) return no_package(package.folder, lines.error());
    package.files.insert(package.files.end(), lines->begin(), lines->end());
    if (name == manifest_file) continue;  // the tag manifest holds its sum
    package.files.push_back({name, sha256_hex(*text)});
    manifests += *text;
  }
  package.sha256 = sha256_hex(manifests);
  // A folder with bagit.txt is complete: it comes last.
  const auto declaration = std::ranges::find(package.files, bagit_file, &ManifestLine::path);
  if (declaration == package.files.end()) {
    return no_package(package.folder,
                      {ErrorKind::bad_input, tag_manifest_file, "has no bagit.txt", {}});
  }
  std::rotate(declaration, declaration + 1, package.files.end());

  const auto metadata = read_file(package.folder / metadata_file);
  if (!metadata) return no_package(package.folder, metadata.error());
  const auto json = nlohmann::ordered_json::parse(*metadata, nullptr, false);
  package.case_number = text_at(json, "/case");
  package.station = text_at(json, "/station");
  if (package.case_number.empty()) {
    return no_package(package.folder, {ErrorKind::bad_input, metadata_file, "names no case", {}});
  }
  return package;
}

Result<std::vector<DeliveryObject>> objects_for(const TargetConfig& target,
                                                const SealedPackage& package,
                                                const fs::path& work) {
  if (holds_files(target.protocol)) return files_of(package);
  if (const auto made = make_writable_folder(work); !made) return forward(made);
  if (target.protocol == DeliveryProtocol::fhir) return write_fhir_bundle(package, work);
  return write_dicom_objects(package, target.max_photographs, work);
}

Result<DeliveryObject> probe_for(const TargetConfig& target, const std::string& station,
                                 const fs::path& work) {
  if (const auto made = make_writable_folder(work); !made) return forward(made);
  if (target.protocol == DeliveryProtocol::fhir) return write_fhir_probe(station, work);
  if (!holds_files(target.protocol)) return write_dicom_probe(station, work);
  const std::string text = fmt::format(
      "Station {} tries whether it can deliver here. This file may be removed.\n", station);
  const fs::path file = work / "probe.txt";
  if (const auto written = write_file_durably(file, text); !written) return forward(written);
  return DeliveryObject{"skullstation-probe.txt", file, text.size(), sha256_hex(text)};
}

std::string sum_of(const std::vector<DeliveryObject>& objects) {
  std::vector<ManifestLine> lines;
  lines.reserve(objects.size());
  for (const DeliveryObject& object : objects) lines.push_back({object.name, object.sha256});
  return sha256_hex(format_manifest(lines));
}

}  // namespace skullstation
