#include "daemon/evidence/provenance.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

/// A value of a JSON document, or null.
Json at(const Json& json, const std::string& pointer) {
  const Json::json_pointer place(pointer);
  return json.contains(place) ? json[place] : Json(nullptr);
}

class Provenance {
 public:
  Provenance() {
    document_["prefix"] = {{"sk", "urn:skullstation:"}};
    for (const char* kind : {"entity", "activity", "agent", "wasGeneratedBy", "used",
                             "wasAssociatedWith", "wasDerivedFrom"}) {
      document_[kind] = Json::object();
    }
  }

  void add(const char* kind, const std::string& name, Json attributes) {
    document_[kind][name] = std::move(attributes);
  }
  void generated(const std::string& entity, const std::string& activity) {
    relate("wasGeneratedBy", {{"prov:entity", entity}, {"prov:activity", activity}});
  }
  void used(const std::string& activity, const std::string& entity) {
    relate("used", {{"prov:activity", activity}, {"prov:entity", entity}});
  }
  void by(const std::string& activity, const std::string& agent) {
    relate("wasAssociatedWith", {{"prov:activity", activity}, {"prov:agent", agent}});
  }
  void derived(const std::string& entity, const std::string& from) {
    relate("wasDerivedFrom", {{"prov:generatedEntity", entity}, {"prov:usedEntity", from}});
  }

  std::string text() const { return document_.dump(2) + "\n"; }

 private:
  void relate(const char* kind, Json relation) {
    document_[kind][fmt::format("_:r{}", ++relations_)] = std::move(relation);
  }

  Json document_;
  int relations_ = 0;
};

Json file_entity(const std::string& path, const FileDigest& digest) {
  return {{"sk:file", path}, {"sk:bytes", digest.bytes}, {"sk:sha256", digest.sha256}};
}

/// The sealed files below data/PART/ as entities that `activity` made.
void add_files(Provenance& provenance, const std::map<std::string, FileDigest>& sealed,
               const std::string& part, const char* activity) {
  const std::string below = fmt::format("data/{}/", part);
  for (const auto& [path, digest] : sealed) {
    if (!path.starts_with(below)) continue;
    const std::string entity = fmt::format("sk:{}", path.substr(5));
    provenance.add("entity", entity, file_entity(path, digest));
    provenance.generated(entity, activity);
  }
}

void add_scan(Provenance& provenance, const PackageContent& content,
              const std::map<std::string, FileDigest>& sealed) {
  const Session& session = *content.session;
  Json scan = {{"prov:startTime", session.created}};
  if (!session.views.empty() && session.views.back().captured) {
    scan["prov:endTime"] = *session.views.back().captured;
  }
  scan["sk:views"] = session.views.size();
  if (session.complete) scan["sk:complete"] = *session.complete;
  provenance.add("activity", "sk:scan", scan);
  if (!session.station.empty()) {
    provenance.add("agent", "sk:station", {{"sk:id", session.station}});
    provenance.by("sk:scan", "sk:station");
  }
  add_files(provenance, sealed, "session", "sk:scan");
}

void add_reconstruction(Provenance& provenance, const PackageContent& content,
                        const std::map<std::string, FileDigest>& sealed) {
  const Json& quality = *content.reconstruction_quality;
  Json reconstruct = Json::object();
  for (const char* figure : {"/views_used", "/reprojection_rms_px", "/scale/source",
                             "/scale/standard_error_percent", "/accuracy_mm/median"}) {
    const Json value = at(quality, figure);
    if (!value.is_null()) reconstruct[fmt::format("sk:{}", figure + 1)] = value;
  }
  provenance.add("activity", "sk:reconstruct", reconstruct);
  add_files(provenance, sealed, "reconstruction", "sk:reconstruct");
  if (content.session) {
    provenance.used("sk:reconstruct", "sk:session/session.json");
    for (const SessionView& view : content.session->views) {
      provenance.used("sk:reconstruct", "sk:session/" + view.image);
    }
  }
}

void add_approximation(Provenance& provenance, const PackageContent& content,
                       const std::map<std::string, FileDigest>& sealed) {
  const Json& record = content.case_json;
  // The skull's mesh lies in the package, or is known by its sum alone.
  std::string skull = "sk:reconstruction/skull.ply";
  if (!sealed.contains("data/reconstruction/skull.ply")) {
    skull = "sk:skull";
    provenance.add("entity", skull,
                   {{"sk:name", at(record, "/input/file")},
                    {"sk:sha256", at(record, "/input/sha256")},
                    {"sk:in_this_package", false}});
  }
  provenance.add("entity", "sk:model",
                 {{"sk:name", at(record, "/model/file")},
                  {"sk:sha256", at(record, "/model/sha256")},
                  {"sk:card", at(record, "/model/card")},
                  {"sk:subjects", at(record, "/model/subjects")},
                  {"sk:in_this_package", false}});
  provenance.add("agent", "sk:approximate-program",
                 {{"prov:type", "prov:SoftwareAgent"},
                  {"sk:name", "skullstation approximate"},
                  {"sk:version", at(record, "/program_version")}});
  provenance.add("activity", "sk:approximate",
                 {{"sk:seed", at(record, "/seed")}, {"sk:facts", at(record, "/facts").dump()}});
  provenance.by("sk:approximate", "sk:approximate-program");
  provenance.used("sk:approximate", skull);
  provenance.used("sk:approximate", "sk:model");
  add_files(provenance, sealed, "case", "sk:approximate");
  provenance.derived("sk:case/case.json", skull);
  provenance.derived("sk:case/case.json", "sk:model");
}

}  // namespace

std::string provenance_json(const PackageContent& content,
                            const std::map<std::string, FileDigest>& sealed) {
  Provenance provenance;
  if (content.session) add_scan(provenance, content, sealed);
  if (content.reconstruction_quality) add_reconstruction(provenance, content, sealed);
  add_approximation(provenance, content, sealed);
  return provenance.text();
}

std::string metadata_json(const PackageContent& content,
                          const std::vector<std::string>& sealed_with,
                          const std::string& ed25519_fingerprint,
                          const std::string& certificate_fingerprint) {
  Json parts = {{"case", "data/case"}};
  if (content.session) parts["session"] = "data/session";
  if (content.reconstruction_quality) parts["reconstruction"] = "data/reconstruction";
  return Json{{"format", "skullstation-package/1"},
              {"case", content.case_number},
              {"station", content.station},
              {"packaged_by", fmt::format("skullstation {}", content.program_version)},
              {"parts", parts},
              {"files", content.files.size()},
              {"bytes", content.bytes},
              {"block_bytes", block_bytes},
              {"purpose", "A facial approximation is an investigative aid, not an identification."},
              {"model_card", at(content.case_json, "/model/card")},
              {"warnings", at(content.case_json, "/warnings")},
              {"sealed_with", sealed_with},
              {"ed25519_key_sha256", ed25519_fingerprint},
              {"certificate_sha256", certificate_fingerprint}}
             .dump(2) +
         "\n";
}

std::string bag_info(const PackageContent& content) {
  std::string text = fmt::format("Bag-Software-Agent: skullstation {}\n", content.program_version);
  text += fmt::format("External-Identifier: {}\n", content.case_number);
  text += "External-Description: Facial approximation from a skull, with what it was made from\n";
  if (!content.station.empty()) {
    text += fmt::format("Internal-Sender-Identifier: {}\n", content.station);
  }
  return text + fmt::format("Payload-Oxum: {}.{}\n", content.bytes, content.files.size());
}

}  // namespace skullstation
