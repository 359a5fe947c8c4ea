#include <fmt/format.h>

#include <algorithm>

#include "core/url_path.h"
#include "daemon/exhibit/exhibit_parts.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Json in_english(const std::string& text) { return {{"en", Json::array({text})}}; }

Json entry(const std::string& label, const std::string& value) {
  return {{"label", in_english(label)}, {"value", in_english(value)}};
}

/// The licence as its registry spells it; empty for one of another registry, which `rights` may not
/// hold (Presentation 3.0, 3.2). The registries' addresses are http, whatever they are served by.
std::string registered_licence(const std::string& url) {
  const std::string address = url.substr(std::min(url.find("://"), url.size()));
  for (const char* registry :
       {"://creativecommons.org/licenses/", "://creativecommons.org/publicdomain/",
        "://rightsstatements.org/vocab/"}) {
    if (address.starts_with(registry)) return "http" + address;
  }
  return {};
}

Json canvas(const std::string& base, const ExhibitPicture& picture) {
  const std::string file = url_path(picture.file);
  const std::string id = fmt::format("{}/canvas/{}", base, file);
  const Json image = {{"id", fmt::format("{}/{}", base, file)},
                      {"type", "Image"},
                      {"format", "image/png"},
                      {"width", picture.width},
                      {"height", picture.height}};
  const Json annotation = {{"id", id + "/page/painting"},
                           {"type", "Annotation"},
                           {"motivation", "painting"},
                           {"body", image},
                           {"target", id}};
  const Json page = {
      {"id", id + "/page"}, {"type", "AnnotationPage"}, {"items", Json::array({annotation})}};
  return {{"id", id},
          {"type", "Canvas"},
          {"label", in_english(picture.title)},
          {"width", picture.width},
          {"height", picture.height},
          {"items", Json::array({page})}};
}

}  // namespace

Json iiif_manifest(const Exhibit& exhibit) {
  const ExhibitLabel& label = exhibit.label;
  const std::string& base = exhibit.address;
  Json manifest = {{"@context", "http://iiif.io/api/presentation/3/context.json"},
                   {"id", base + "/manifest.json"},
                   {"type", "Manifest"},
                   {"label", in_english(exhibit.title)}};
  manifest["metadata"] =
      Json::array({entry("Case", exhibit.case_number), entry("Scanned by station", exhibit.station),
                   entry("Made with", exhibit.made_by),
                   entry("Sealed package (SHA-256)", exhibit.package_sha256)});
  if (!label.holder.empty()) manifest["metadata"].push_back(entry("Institution", label.holder));
  const std::string licence = registered_licence(label.rights_url);
  if (!licence.empty()) manifest["rights"] = licence;
  if (licence.empty() && !label.rights_url.empty()) {
    manifest["metadata"].push_back(entry("Licence", label.rights_url));
  }
  std::vector<std::string> notes = exhibit.warnings;
  if (!label.rights.empty()) notes.insert(notes.begin(), label.rights);
  if (!notes.empty()) {
    manifest["requiredStatement"] = {{"label", in_english("To be known")},
                                     {"value", {{"en", notes}}}};
  }
  manifest["rendering"] = Json::array();
  for (const ExhibitModel& model : exhibit.models) {
    manifest["rendering"].push_back({{"id", fmt::format("{}/{}", base, model.file)},
                                     {"type", "Model"},
                                     {"label", in_english(model.title)},
                                     {"format", "model/gltf-binary"}});
  }
  manifest["items"] = Json::array();
  for (const ExhibitPicture& picture : exhibit.pictures) {
    manifest["items"].push_back(canvas(base, picture));
  }
  return manifest;
}

}  // namespace skullstation
