// FHIR R4: a transaction, read back by its documents' identifiers.

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/url_path.h"
#include "daemon/delivery/curl_session.h"
#include "daemon/delivery/fhir_bundle.h"
#include "daemon/delivery/target.h"
#include "daemon/evidence/package_source.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

/// The most of an answer that is held in memory while it is compared.
constexpr std::size_t most_bytes = std::size_t{1} << 29;
constexpr const char* json_type = "application/fhir+json";

class FhirTarget final : public Target {
 public:
  FhirTarget(std::string address, std::unique_ptr<CurlSession> session)
      : address_(std::move(address)), session_(std::move(session)) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    const auto answer =
        session_->send({.method = "POST",
                        .url = address_,
                        .headers = {fmt::format("Content-Type: {}", json_type),
                                    fmt::format("Accept: {}", json_type), "Prefer: return=minimal"},
                        .file = object.file},
                       progress);
    if (!answer) return forward(answer);
    if (answer->status == 200 || answer->status == 201) return {};
    auto refused = status_error(address_, *answer);
    const auto outcome = Json::parse(answer->body, nullptr, false);
    const std::string why = text_at(outcome, "/issue/0/diagnostics");
    if (!why.empty()) refused.value().what += ": " + why.substr(0, 300);
    return refused;
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    const auto documents = documents_there(object, progress);
    if (!documents) return forward(documents);
    if (!*documents) return std::optional<std::string>();
    return std::optional(fhir_sum(**documents));
  }

  Result<bool> remove(const DeliveryObject& object) override {
    const auto documents = documents_there(object, {});
    if (!documents) return forward(documents);
    if (!*documents) return true;
    for (const Json& document : **documents) {
      const std::string url = address_ + "/DocumentReference/" + url_path(text_at(document, "/id"));
      const auto answer = session_->send({.method = "DELETE", .url = url});
      if (!answer) return forward(answer);
      if (answer->status == 405 || answer->status == 403) return false;  // it never deletes
      if (answer->status >= 300) return status_error(url, *answer);
    }
    return true;
  }

 private:
  /// The object's documents as the receiver holds them; nothing if it lacks one.
  Result<std::optional<std::vector<Json>>> documents_there(const DeliveryObject& object,
                                                           const Progress& progress) {
    const auto sent = read_file(object.file);
    if (!sent) return forward(sent);
    std::vector<Json> there;
    for (const Json& document : fhir_documents(Json::parse(*sent, nullptr, false))) {
      const std::string wanted = fhir_identifier(document);
      std::string query = url_path(wanted);
      const std::string url = fmt::format("{}/DocumentReference?identifier={}", address_, query);
      const auto answer = session_->send(
          {.url = url,
           .headers = {fmt::format("Accept: {}", json_type), "Cache-Control: no-cache"},
           .keep_bytes = most_bytes},
          progress);
      if (!answer) return forward(answer);
      if (answer->status != 200) return status_error(url, *answer);
      const auto bundle = Json::parse(answer->body, nullptr, false);
      if (text_at(bundle, "/resourceType") != "Bundle") {
        return fail(ErrorKind::bad_input, url, "answers with something else than a FHIR Bundle",
                    "check the address: it must be the server's base URL, then retry");
      }
      auto found = fhir_documents(bundle);
      std::erase_if(found, [&](const Json& one) { return fhir_identifier(one) != wanted; });
      if (found.empty()) return std::optional<std::vector<Json>>();
      if (found.size() > 1) {
        return fail(ErrorKind::bad_input, url,
                    fmt::format("holds {} documents of one identifier", found.size()),
                    "have all but one removed there, then retry");
      }
      there.push_back(std::move(found.front()));
    }
    return std::optional(std::move(there));
  }

  std::string address_;
  std::unique_ptr<CurlSession> session_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_fhir_target(const TargetConfig& config) {
  auto session = CurlSession::open(config);
  if (!session) return forward(session);
  return std::make_unique<FhirTarget>(without_slash(config.address), *std::move(session));
}

}  // namespace skullstation
