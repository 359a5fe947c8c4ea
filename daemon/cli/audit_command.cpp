#include <fmt/format.h>

#include <deque>
#include <fstream>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/cli/commands.h"
#include "daemon/evidence/audit_check.h"
#include "daemon/evidence/package.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

/// The entry that a package carries, or that a file holds.
Result<AuditHead> read_head(const std::filesystem::path& path) {
  std::error_code ignored;
  const bool package = std::filesystem::is_directory(path, ignored);
  const auto text = read_file(package ? path / audit_entry_file : path);
  if (!text) {
    Error error = text.error();
    if (package) error.advice = "this package was sealed without an audit log";
    return tl::unexpected(std::move(error));
  }
  return AuditHead{path.string(), text->substr(0, text->find('\n'))};
}

std::string in_words(const AuditFinding& finding) {
  if (finding.line == 0) return fmt::format("  {}\n", finding.what);
  return fmt::format("  line {} (bytes {} to {}): {}\n", finding.line, finding.begin,
                     finding.end - 1, finding.what);
}

Json json_of(const std::vector<AuditFinding>& findings) {
  Json list = Json::array();
  for (const AuditFinding& f : findings) {
    list.push_back({{"line", f.line}, {"byte_range", {f.begin, f.end}}, {"what", f.what}});
  }
  return list;
}

}  // namespace

Result<CommandReport> run(const AuditVerifyCommand& command, const CommonOptions&,
                          const Progress&) {
  std::optional<Trust> trust;
  if (!command.trust.empty()) {
    auto read = read_trust(command.trust);
    if (!read) return forward(read);
    if (read->public_keys_pem.empty()) {
      return fail(ErrorKind::bad_input, command.trust.string(),
                  "holds no public key, and audit logs are signed with the Ed25519 key alone",
                  "give the station's ed25519.pub.pem");
    }
    trust = *std::move(read);
  }
  std::vector<AuditHead> heads;
  for (const auto& path : command.heads) {
    auto head = read_head(path);
    if (!head) return forward(head);
    heads.push_back(*std::move(head));
  }
  const auto check = check_audit_file(command.log, trust, heads);
  if (!check) return forward(check);

  CommandReport report;
  const bool intact = check->findings.empty();
  report.text = fmt::format(
      "{}: {}\n", command.log.string(),
      intact ? "nothing in it was changed, removed or reordered" : "NOT as it was written");
  for (const AuditFinding& finding : check->findings) report.text += in_words(finding);
  if (!check->notes.empty()) report.text += "to be known:\n";
  for (const AuditFinding& note : check->notes) report.text += in_words(note);
  report.text += fmt::format("{} entries of station {}, the last of {}\n  head {}\n  key  {}{}\n",
                             check->entries, check->station, check->last_time, check->head_sha256,
                             check->key_fingerprint,
                             !check->key_trusted   ? " (not compared: no --trust)"
                             : *check->key_trusted ? " (trusted)"
                                                   : " (NOT trusted)");
  if (heads.empty()) {
    report.text += "  whether its end was removed shows only against a package (--head)\n";
  }
  Json json = {{"log", command.log.string()},
               {"intact", intact},
               {"entries", check->entries},
               {"station", check->station},
               {"last_time", check->last_time},
               {"head_sha256", check->head_sha256},
               {"key_sha256", check->key_fingerprint},
               {"heads_compared", heads.size()}};
  json["key_trusted"] = check->key_trusted ? Json(*check->key_trusted) : Json(nullptr);
  json["findings"] = json_of(check->findings);
  json["notes"] = json_of(check->notes);
  report.json = json.dump(2);
  report.exit_code = intact ? 0 : exit_code(ErrorKind::bad_input);
  return report;
}

Result<CommandReport> run(const AuditShowCommand& command, const CommonOptions&, const Progress&) {
  // Complains for a folder or a file that can't be read, and says whether what is shown is sound.
  const auto check = check_audit_file(command.log, std::nullopt, {});
  if (!check) return forward(check);
  std::ifstream in(command.log, std::ios::binary);
  std::deque<AuditEntry> entries;
  for (std::string line; std::getline(in, line);) {
    const auto entry = parse_audit_entry(line, "");
    if (!entry || (!command.case_number.empty() && entry->subject != command.case_number)) continue;
    entries.push_back(*entry);
    if (command.last > 0 && entries.size() > static_cast<std::size_t>(command.last)) {
      entries.pop_front();
    }
  }
  CommandReport report;
  Json list = Json::array();
  for (const AuditEntry& e : entries) {
    report.text += fmt::format("{:>6}  {}  {:<12} {:<12} {:<14} {}\n", e.number, e.time, e.who,
                               e.what, e.subject, e.what == "log begun" ? "" : e.details);
    list.push_back({{"number", e.number},
                    {"time", e.time},
                    {"station", e.station},
                    {"who", e.who},
                    {"what", e.what},
                    {"case", e.subject},
                    {"details", Json::parse(e.details)}});
  }
  if (!check->findings.empty()) {
    report.text += fmt::format("NOT as it was written: `skullstation audit verify {}`\n",
                               command.log.string());
    report.exit_code = exit_code(ErrorKind::bad_input);
  }
  report.json =
      Json{{"log", command.log.string()}, {"intact", check->findings.empty()}, {"entries", list}}
          .dump(2);
  return report;
}

}  // namespace skullstation
