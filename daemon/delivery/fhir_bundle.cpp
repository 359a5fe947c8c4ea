#include "daemon/delivery/fhir_bundle.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/delivery/dicom_objects.h"
#include "daemon/evidence/package_source.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using Json = nlohmann::ordered_json;

/// FHIR's unsignedInt ends here: larger sizes are left out.
constexpr std::uint64_t largest_size = 2147483647;

std::string to_base64(std::string_view bytes) {
  std::string text(4 * ((bytes.size() + 2) / 3) + 1, '\0');
  const int length = EVP_EncodeBlock(reinterpret_cast<unsigned char*>(text.data()),
                                     reinterpret_cast<const unsigned char*>(bytes.data()),
                                     static_cast<int>(bytes.size()));
  text.resize(static_cast<std::size_t>(length));
  return text;
}

/// R4's attachment.hash is SHA-1, whatever one thinks of that; SHA-256 stands beside it.
std::string sha1_base64(std::string_view bytes) {
  std::string sum(20, '\0');
  EVP_Digest(bytes.data(), bytes.size(), reinterpret_cast<unsigned char*>(sum.data()), nullptr,
             EVP_sha1(), nullptr);
  return to_base64(sum);
}

/// What kind of value an identifier or an extension holds, as a name that nobody else uses.
std::string system_of(const std::string& kind) {
  return "urn:oid:" + uid_of("skullstation " + kind);
}

Json identifier(const std::string& kind, const std::string& value) {
  return {{"system", system_of(kind)}, {"value", value}};
}

Json document(const std::string& kind, const std::string& value, const std::string& type,
              const std::string& description, Json attachment, const std::string& sha256) {
  attachment["extension"] =
      Json::array({Json{{"url", system_of("SHA-256 of an attachment")}, {"valueString", sha256}}});
  return {{"resourceType", "DocumentReference"},
          {"identifier", Json::array({identifier(kind, value)})},
          {"status", "current"},
          {"type", {{"text", type}}},
          {"description", description},
          {"content", Json::array({Json{{"attachment", std::move(attachment)}}})}};
}

Json document_with(const std::string& bytes, const std::string& mime, const std::string& kind,
                   const std::string& value, const std::string& type, const std::string& title) {
  return document(kind, value, type, title,
                  {{"contentType", mime},
                   {"data", to_base64(bytes)},
                   {"size", bytes.size()},
                   {"hash", sha1_base64(bytes)},
                   {"title", title}},
                  sha256_hex(bytes));
}

/// An entry of the transaction; `full_url` is how others in it call it.
Json entry(const std::string& full_url, Json resource) {
  const std::string type = resource["resourceType"];
  const std::string known_by = fhir_identifier(resource);
  return {
      {"fullUrl", full_url},
      {"resource", std::move(resource)},
      {"request", {{"method", "POST"}, {"url", type}, {"ifNoneExist", "identifier=" + known_by}}}};
}

/// A UUID made of a sum, for references inside the bundle.
std::string uuid_url(const std::string& text) {
  const std::string hex = sha256_hex(text);
  return fmt::format("urn:uuid:{}-{}-4{}-8{}-{}", hex.substr(0, 8), hex.substr(8, 4),
                     hex.substr(12, 3), hex.substr(15, 3), hex.substr(18, 12));
}

Result<DeliveryObject> save(const std::string& name, Json entries, const fs::path& work) {
  const Json bundle = {
      {"resourceType", "Bundle"}, {"type", "transaction"}, {"entry", std::move(entries)}};
  const std::string text = bundle.dump(1, ' ', false, Json::error_handler_t::replace);
  const fs::path file = work / "bundle.json";
  if (const auto written = write_file_durably(file, text); !written) return forward(written);
  return DeliveryObject{name, file, text.size(), fhir_sum(fhir_documents(bundle))};
}

}  // namespace

std::vector<Json> fhir_documents(const Json& bundle) {
  std::vector<Json> documents;
  if (!bundle.is_object() || !bundle.contains("entry") || !bundle["entry"].is_array()) return {};
  for (const Json& one : bundle["entry"]) {
    if (text_at(one, "/resource/resourceType") == "DocumentReference") {
      documents.push_back(one["resource"]);
    }
  }
  return documents;
}

std::string fhir_identifier(const Json& resource) {
  const std::string value = text_at(resource, "/identifier/0/value");
  return value.empty() ? "" : text_at(resource, "/identifier/0/system") + "|" + value;
}

std::string fhir_sum(const std::vector<Json>& documents) {
  std::string facts;
  for (const Json& one : documents) {
    facts += fhir_identifier(one);
    const Json::json_pointer place("/content/0/attachment");
    const Json attachment = one.contains(place) ? one[place] : Json::object();
    for (const char* key : {"contentType", "title", "size", "hash", "data"}) {
      facts += "\n" + (attachment.contains(key) ? attachment[key].dump() : std::string("-"));
    }
    facts += "\n" + text_at(attachment, "/extension/0/valueString") + "\n";
  }
  return sha256_hex(facts);
}

Result<std::vector<DeliveryObject>> write_fhir_bundle(const SealedPackage& package,
                                                      const fs::path& work) {
  const std::string person = uuid_url("person " + package.station + " " + package.case_number);
  Json entries = Json::array();
  entries.push_back(entry(
      person,
      {{"resourceType", "Patient"},
       {"identifier",
        Json::array({identifier("case of station " + package.station, package.case_number)})},
       {"name", Json::array({Json{{"use", "anonymous"},
                                  {"text", "Unidentified person, case " + package.case_number}}})},
       {"gender", "unknown"},
       {"deceasedBoolean", true}}));
  const auto add = [&](const std::string& name, Json resource) {
    resource["subject"] = {{"reference", person}};
    entries.push_back(entry(uuid_url(package.sha256 + name), std::move(resource)));
  };
  std::error_code ignored;
  const fs::path report = package.folder / "data/case/report.pdf";
  if (fs::exists(report, ignored)) {
    const auto bytes = read_file(report);
    if (!bytes) return forward(bytes);
    add("report", document_with(*bytes, "application/pdf", "report of a package", package.sha256,
                                "Report of a facial approximation",
                                "Facial approximation: an investigative aid, no identification"));
  }
  std::uint64_t bytes = 0;
  for (const ManifestLine& line : package.files) {
    const auto size = fs::file_size(package.folder / line.path, ignored);
    bytes += ignored ? 0 : size;
  }
  Json attachment = {{"contentType", "application/octet-stream"}, {"title", package.remote_name()}};
  if (bytes <= largest_size) attachment["size"] = bytes;
  add("package", document("package", package.sha256, "Sealed evidence package",
                          "BagIt package of the case, kept at the station; its sum is that of its "
                          "tag manifest and the manifest of its signatures, one after the other",
                          std::move(attachment), package.sha256));
  auto object = save(package.remote_name(), std::move(entries), work);
  if (!object) return forward(object);
  return std::vector<DeliveryObject>{*std::move(object)};
}

Result<DeliveryObject> write_fhir_probe(const std::string& station, const fs::path& work) {
  const std::string text = "Station " + station + " tried whether it can deliver here.\n";
  return save("skullstation-probe",
              Json::array({entry(uuid_url("probe " + station),
                                 document_with(text, "text/plain", "probe", sha256_hex(station),
                                               "Probe", "Probe, may be removed"))}),
              work);
}

}  // namespace skullstation
