#include <fmt/format.h>

#include <algorithm>
#include <deque>
#include <fstream>

#include "daemon/evidence/audit_check.h"
#include "daemon/http/actions.h"
#include "daemon/web/web_assets.h"

namespace skullstation::actions {

namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

std::optional<Role> role_in(JsonObject& body, const std::optional<std::string>& name) {
  if (!name) return std::nullopt;
  const auto role = role_named(*name);
  if (!role) {
    body.fault("role", "must be viewer, operator, examiner, administrator or auditor");
  }
  return role;
}

}  // namespace

Response accounts(Console& console, Call&) {
  const auto all = console.accounts.list();
  if (!all) return refusal(all.error());
  Json list = Json::array();
  for (const Account& account : *all) {
    list.push_back({{"name", account.name},
                    {"role", to_string(account.role)},
                    {"created", account.created},
                    {"disabled", account.disabled}});
  }
  return json_answer(200, text_of({{"accounts", list}}));
}

Response add_account(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string name = body.text("name");
  const auto role = role_in(body, body.text("role"));
  const std::string password = body.text("password");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  call.details["account"] = name;
  call.details["role"] = to_string(*role);
  if (auto added = console.accounts.add(name, *role, password); !added) {
    return refusal(added.error());
  }
  return json_answer(201, R"({"done":true})");
}

Response change_account(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const auto role = role_in(body, body.optional_text("role"));
  const auto disabled = body.optional_flag("disabled");
  const auto password = body.optional_text("password");
  if ((role ? 1 : 0) + (disabled ? 1 : 0) + (password ? 1 : 0) != 1) {
    body.fault("", "must name one of role, disabled, password");
  }
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  const std::string& name = call.parts.at("account");
  call.details["account"] = name;
  const auto all = console.accounts.list();
  if (!all) return refusal(all.error());
  if (std::ranges::find(*all, name, &Account::name) == all->end()) {
    return refusal(404, "not_found", "there is no such account");
  }
  if (role) call.details["role"] = to_string(*role);
  if (disabled) call.details["disabled"] = *disabled;
  if (password) call.details["password"] = "changed";
  const Result<void> done = role       ? console.accounts.set_role(name, *role)
                            : disabled ? console.accounts.set_disabled(name, *disabled)
                                       : console.accounts.set_password(name, *password);
  return done ? json_answer(200, R"({"done":true})") : refusal(done.error());
}

/// The last entries of the log, the newest first, whatever its length.
Response audit(Console& console, Call& call) {
  constexpr std::streamoff most_bytes = std::streamoff{1} << 20;
  constexpr std::size_t most_entries = 500;
  std::ifstream log(console.audit.place.file, std::ios::binary | std::ios::ate);
  std::deque<Json> newest;
  if (log) {
    const std::streamoff size = log.tellg();
    log.seekg(std::max<std::streamoff>(0, size - most_bytes));
    const auto subject = call.request.query.find("case");
    for (std::string line; std::getline(log, line);) {
      const auto entry = parse_audit_entry(line, "");  // the first one may be cut
      if (!entry) continue;
      if (subject != call.request.query.end() && entry->subject != subject->second) continue;
      const Json json = {
          {"number", entry->number}, {"time", entry->time},
          {"who", entry->who},       {"what", entry->what},
          {"case", entry->subject},  {"details", Json::parse(entry->details, nullptr, false)}};
      newest.push_front(json);
      if (newest.size() > most_entries) newest.pop_back();
    }
  }
  Json list = Json::array();
  for (const Json& entry : newest) list.push_back(entry);
  return json_answer(200, text_of({{"entries", list}}));
}

Response audit_check(Console& console, Call&) {
  const auto check = check_audit_file(console.audit.place.file, std::nullopt, {});
  if (!check) return refusal(check.error());
  const auto in_words = [](const std::vector<AuditFinding>& findings) {
    Json list = Json::array();
    for (const AuditFinding& finding : findings) {
      list.push_back({{"line", finding.line}, {"what", finding.what}});
    }
    return list;
  };
  return json_answer(200, text_of({{"intact", check->findings.empty()},
                                   {"entries", check->entries},
                                   {"head_sha256", check->head_sha256},
                                   {"key_sha256", check->key_fingerprint},
                                   {"findings", in_words(check->findings)},
                                   {"notes", in_words(check->notes)}}));
}

Response description(Console&, Call&) {
  return json_answer(200, std::string(openapi_description()));
}

}  // namespace skullstation::actions
