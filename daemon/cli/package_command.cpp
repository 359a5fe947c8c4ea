#include <fmt/format.h>
#include <pwd.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "core/clock.h"
#include "daemon/cli/commands.h"
#include "daemon/delivery/time_stamp_client.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/package_check.h"
#include "daemon/station/station_config.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

std::string user_name() {
  const passwd* user = ::getpwuid(::geteuid());
  return user != nullptr ? user->pw_name : fmt::format("user {}", ::geteuid());
}

Json json_of(const PackageFinding& finding) {
  Json ranges = Json::array();
  for (const ByteRange& range : finding.ranges) ranges.push_back({range.begin, range.end});
  return {{"fault", to_string(finding.fault)},
          {"file", finding.file},
          {"byte_ranges", ranges},
          {"what", finding.what}};
}

std::string line_of(const PackageFinding& finding) {
  std::string line =
      fmt::format("  {:<10} {}: {}", to_string(finding.fault), finding.file, finding.what);
  constexpr std::size_t shown = 8;
  for (std::size_t i = 0; i < std::min(shown, finding.ranges.size()); ++i) {
    line += fmt::format("{} {} to {}", i == 0 ? "; within bytes" : ",", finding.ranges[i].begin,
                        finding.ranges[i].end - 1);
  }
  if (finding.ranges.size() > shown) {
    line += fmt::format(" and {} ranges more", finding.ranges.size() - shown);
  }
  return line + "\n";
}

std::string signatures_in_words(const PackageCheck& check) {
  std::string text =
      fmt::format("  Ed25519    {} ({})\n", check.ed25519_valid ? "valid" : "NOT VALID",
                  check.ed25519_fingerprint);
  text += check.cms_signer ? fmt::format("  CMS        valid, by {} at {} by its clock ({})\n",
                                         check.cms_signer->name, check.cms_signer->signing_time,
                                         check.cms_signer->fingerprint)
                           : "  CMS        NOT VALID\n";
  if (check.time_stamp) {
    text += fmt::format("  time stamp {} by the clock of {}{}\n", check.time_stamp->time,
                        check.time_stamp->authority,
                        !check.time_stamp_trusted   ? " (trust not asked)"
                        : *check.time_stamp_trusted ? ", whom you trust"
                                                    : ", who is NOT among those you trust");
  }
  if (check.audit_entry) {
    text +=
        fmt::format("  audit log  entry {} of station {}, {}, by {}\n", check.audit_entry->number,
                    check.audit_entry->station, check.audit_entry->time, check.audit_entry->who);
  }
  if (!check.trusted) {
    text +=
        "  trust      not asked: anybody can seal a package with keys of his own. Compare the\n"
        "             fingerprints with those that the station gave you, or use --trust\n";
  } else {
    text += fmt::format("  trust      {}\n", *check.trusted ? "signed by whom you trust"
                                                            : "NOT signed by anybody you trust");
  }
  return text;
}

Json json_of(const PackageCheck& check) {
  Json cms = {{"valid", check.cms_signer.has_value()}};
  if (check.cms_signer) {
    cms["certificate_name"] = check.cms_signer->name;
    cms["certificate_sha256"] = check.cms_signer->fingerprint;
    cms["signing_time"] = check.cms_signer->signing_time;
  }
  Json json = {
      {"case", check.case_number},
      {"station", check.station},
      {"intact", check.findings.empty()},
      {"files", check.files},
      {"bytes", check.bytes},
      {"signatures",
       {{"ed25519", {{"valid", check.ed25519_valid}, {"key_sha256", check.ed25519_fingerprint}}},
        {"cms", cms}}}};
  if (check.time_stamp) {
    json["time_stamp"] = {
        {"time", check.time_stamp->time},
        {"authority", check.time_stamp->authority},
        {"serial", check.time_stamp->serial},
        {"trusted", check.time_stamp_trusted ? Json(*check.time_stamp_trusted) : Json(nullptr)}};
  }
  json["trusted"] = check.trusted ? Json(*check.trusted) : Json(nullptr);
  if (check.audit_entry) {
    json["audit_entry"] = {{"number", check.audit_entry->number},
                           {"time", check.audit_entry->time},
                           {"station", check.audit_entry->station},
                           {"who", check.audit_entry->who}};
  }
  json["findings"] = Json::array();
  for (const PackageFinding& finding : check.findings) {
    json["findings"].push_back(json_of(finding));
  }
  return json;
}

}  // namespace

Result<CommandReport> run(const PackageCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  PackageSource source;
  source.case_folder = command.case_folder;
  source.session = command.session;
  source.reconstruction = command.reconstruction;
  source.case_number = command.case_number;
  if (!command.config.empty()) source.station = config->station_id;
  source.program_version = SKULLSTATION_VERSION;
  const auto keys = read_station_keys(
      command.keys.empty() ? std::filesystem::path(config->evidence.keys_folder) : command.keys);
  if (!keys) return forward(keys);
  const std::filesystem::path log = command.audit_log.empty()
                                        ? std::filesystem::path(config->evidence.audit_log)
                                        : command.audit_log;
  std::optional<AuditLogPlace> audit_log;
  if (!log.empty()) audit_log = {log, source.station};

  const std::string authority =
      command.time_stamp_url.empty() ? config->evidence.time_stamp_url : command.time_stamp_url;
  const Seal seal{*keys, audit_log, command.by.empty() ? user_name() : command.by,
                  authority.empty() ? TimeStamper() : time_stamper_at(authority)};
  const auto sealed =
      write_package(source, seal, SystemClock(), command.out, common.threads, progress);
  if (!sealed) return forward(sealed);
  CommandReport report;
  report.text = fmt::format(
      "{}\n  case {}: {} files, {:.1f} MB, signed{}\n  SHA-256 of tagmanifest-sha256.txt: {}\n",
      command.out.string(), sealed->case_number, sealed->files,
      static_cast<double>(sealed->bytes) / 1e6,
      (authority.empty() ? std::string() : ", time stamped") +
          (audit_log ? ", in the audit log" : ""),
      sealed->tag_manifest_sha256);
  Json json = {{"package", command.out.string()},
               {"case", sealed->case_number},
               {"files", sealed->files},
               {"bytes", sealed->bytes},
               {"tagmanifest_sha256", sealed->tag_manifest_sha256}};
  json["audit_log"] = audit_log ? Json(log.string()) : Json(nullptr);
  report.json = json.dump(2);
  return report;
}

Result<CommandReport> run(const VerifyCommand& command, const CommonOptions&,
                          const Progress& progress) {
  std::optional<Trust> trust;
  if (!command.trust.empty()) {
    auto read = read_trust(command.trust);
    if (!read) return forward(read);
    trust = *std::move(read);
  }
  const auto check = check_package(command.package, trust, progress);
  if (!check) return forward(check);
  CommandReport report;
  const bool intact = check->findings.empty();
  report.text = fmt::format(
      "{}: {}\n", command.package.string(),
      intact ? fmt::format("as it was sealed (case {}, {} files, {:.1f} MB)", check->case_number,
                           check->files, static_cast<double>(check->bytes) / 1e6)
             : fmt::format("NOT as it was sealed: {} finding{}", check->findings.size(),
                           check->findings.size() == 1 ? "" : "s"));
  for (const PackageFinding& finding : check->findings) report.text += line_of(finding);
  report.text += signatures_in_words(*check);
  Json json = {{"package", command.package.string()}};
  json.update(json_of(*check));
  // File names may be any bytes.
  report.json = json.dump(2, ' ', false, Json::error_handler_t::replace);
  report.exit_code = intact ? 0 : exit_code(ErrorKind::bad_input);
  return report;
}

}  // namespace skullstation
