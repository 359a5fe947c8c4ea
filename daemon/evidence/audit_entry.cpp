#include "daemon/evidence/audit_entry.h"

#include <fmt/format.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "core/session/strict_json.h"
#include "daemon/evidence/bag_manifest.h"
#include "daemon/evidence/signature.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

constexpr std::string_view before_signature = ",\"signature\":\"";
constexpr std::string_view after_signature = "\"}";
constexpr std::size_t signature_digits = 128;

/// The signed part of a line and the signature's digits.
struct SignedLine {
  std::string_view text;
  std::string_view digits;
};

std::optional<SignedLine> split(std::string_view line) {
  const std::size_t tail = before_signature.size() + signature_digits + after_signature.size();
  if (line.size() < tail || !line.ends_with(after_signature)) return std::nullopt;
  const std::string_view text = line.substr(0, line.size() - tail);
  if (line.substr(text.size(), before_signature.size()) != before_signature) return std::nullopt;
  return SignedLine{text, line.substr(text.size() + before_signature.size(), signature_digits)};
}

std::uint64_t count(JsonObject& object, std::string_view key, std::int64_t lowest) {
  return static_cast<std::uint64_t>(
      object.optional_integer(key, lowest, std::numeric_limits<std::int64_t>::max()).value_or(0));
}

}  // namespace

Result<std::string> format_audit_entry(const AuditEntry& entry, const StationKeys& keys) {
  std::string text;
  try {
    Json json = {{"number", entry.number},
                 {"time", entry.time},
                 {"station", entry.station},
                 {"who", entry.who},
                 {"what", entry.what},
                 {"case", entry.subject},
                 {"details", Json::parse(entry.details)}};
    if (entry.torn) json["torn"] = {{"bytes", entry.torn->bytes}, {"sha256", entry.torn->sha256}};
    json["previous"] = entry.previous;
    text = json.dump();
  } catch (const nlohmann::json::exception&) {
    return fail(ErrorKind::bad_input, "audit entry",
                fmt::format("can't be written: \"{}\" holds text that is no UTF-8, or its details "
                            "are no JSON",
                            entry.what));
  }
  text.pop_back();  // the closing brace comes after the signature
  const std::string digits = to_hex(ed25519_sign(keys, text));
  text += fmt::format("{}{}{}", before_signature, digits, after_signature);
  if (text.size() > max_audit_line) {
    return fail(ErrorKind::bad_input, "audit entry",
                fmt::format("would have {} bytes; {} is the most", text.size(), max_audit_line));
  }
  return text;
}

Result<AuditEntry> parse_audit_entry(std::string_view line, std::string_view name) {
  if (line.size() > max_audit_line) {
    return fail(ErrorKind::bad_input, std::string(name), "is longer than any entry");
  }
  if (!split(line)) {
    return fail(ErrorKind::bad_input, std::string(name), "does not end with a signature");
  }
  const auto json = parse_strict_json(line, name);
  if (!json) return forward(json);
  JsonFaults faults(name);
  JsonObject object(*json, "", faults);
  AuditEntry entry;
  entry.number = count(object, "number", 1);
  entry.time = object.text("time");
  entry.station = object.text("station");
  entry.who = object.text("who");
  entry.what = object.text("what");
  entry.subject = object.text("case");
  if (const auto* details = object.require("details")) entry.details = details->dump();
  if (const auto* torn = object.find("torn")) {
    JsonObject bytes(*torn, "torn", faults);
    entry.torn = TornBytes{count(bytes, "bytes", 1), bytes.text("sha256")};
    bytes.finish();
  }
  entry.previous = object.text("previous");
  object.text("signature");
  object.finish();
  if (!faults.first() && (entry.number == 0 || !is_sha256(entry.previous))) {
    object.fault(entry.number == 0 ? "number" : "previous", "is not what an entry has there");
  }
  if (faults.first()) return tl::unexpected(*faults.first());
  return entry;
}

bool audit_signature_valid(std::string_view line, std::string_view public_pem) {
  const auto parts = split(line);
  if (!parts) return false;
  const auto signature = from_hex(parts->digits, "");
  return signature && ed25519_verify(public_pem, parts->text, *signature);
}

std::optional<std::string> public_key_of(const AuditEntry& first) {
  const auto details = nlohmann::json::parse(first.details, nullptr, false);
  if (first.number != 1 || !details.is_object()) return std::nullopt;
  const auto key = details.find("public_key");
  if (key == details.end() || !key->is_string()) return std::nullopt;
  return key->get<std::string>();
}

}  // namespace skullstation
