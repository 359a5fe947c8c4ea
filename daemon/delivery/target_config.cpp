#include "daemon/delivery/target_config.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <string_view>
#include <vector>

namespace skullstation {

namespace {

using enum DeliveryProtocol;

/// Which schemes an address may have and which further keys a protocol knows, needs first.
struct ProtocolKeys {
  DeliveryProtocol protocol;
  std::string_view scheme;        ///< empty: a path
  std::string_view plain_scheme;  ///< without encryption: for this machine only
  std::vector<std::string_view> needed;
  std::vector<std::string_view> known;
};

const ProtocolKeys& keys_of(DeliveryProtocol protocol) {
  static const std::vector<std::string_view> https = {"user", "secret", "ca_file",
                                                      "certificate_file", "key_file"};
  static const std::vector<std::string_view> stow_keys = [] {
    auto keys = https;
    keys.emplace_back("max_photographs");
    return keys;
  }();
  static const std::array<ProtocolKeys, 7> table{{
      {folder, "", "", {}, {"mounted"}},
      {webdav, "https://", "http://", {}, https},
      {s3, "https://", "http://", {"user", "secret", "region"}, {"ca_file"}},
      {sftp, "sftp://", "", {"user", "host_key_sha256"}, {"secret", "key_file"}},
      {dicom,
       "dicoms://",
       "dicom://",
       {"called_ae", "calling_ae"},
       {"ca_file", "certificate_file", "key_file", "max_photographs"}},
      {stow, "https://", "http://", {}, stow_keys},
      {fhir, "https://", "http://", {}, https},
  }};
  return *std::ranges::find(table, protocol, &ProtocolKeys::protocol);
}

struct GivenKey {
  std::string_view name;
  bool given;
};

std::vector<GivenKey> given_keys(const TargetConfig& t) {
  return {{"user", !t.user.empty()},
          {"secret", !t.secret.empty()},
          {"ca_file", !t.ca_file.empty()},
          {"certificate_file", !t.certificate_file.empty()},
          {"key_file", !t.key_file.empty()},
          {"host_key_sha256", !t.host_key_sha256.empty()},
          {"region", !t.region.empty()},
          {"called_ae", !t.called_ae.empty()},
          {"calling_ae", !t.calling_ae.empty()},
          {"mounted", t.mounted},
          {"max_photographs", t.max_photographs.has_value()}};
}

bool contains(const std::vector<std::string_view>& words, std::string_view word) {
  return std::ranges::find(words, word) != words.end();
}

bool is_this_machine(std::string_view rest_of_url) {
  for (const std::string_view host : {"localhost", "127.0.0.1", "[::1]"}) {
    if (!rest_of_url.starts_with(host)) continue;
    const std::string_view after = rest_of_url.substr(host.size());
    if (after.empty() || after.front() == ':' || after.front() == '/') return true;
  }
  return false;
}

Result<void> check_address(const TargetConfig& target, const ProtocolKeys& keys) {
  const auto bad = [](std::string what, std::string advice = {}) {
    return fail(ErrorKind::bad_input, "address", std::move(what), std::move(advice));
  };
  if (keys.scheme.empty()) {
    if (target.address.starts_with('/')) return {};
    return bad("must be an absolute path");
  }
  const bool plain = !keys.plain_scheme.empty() && target.address.starts_with(keys.plain_scheme);
  if (!plain && !target.address.starts_with(keys.scheme)) {
    return bad(fmt::format("must begin with {}", keys.scheme));
  }
  const std::string_view rest = std::string_view(target.address)
                                    .substr(plain ? keys.plain_scheme.size() : keys.scheme.size());
  if (plain && !is_this_machine(rest)) {
    return bad(fmt::format("begins with {}: evidence does not leave this machine unencrypted",
                           keys.plain_scheme),
               fmt::format("use {}", keys.scheme));
  }
  if (rest.empty() || rest.front() == '/') return bad("names no host");
  if (rest.substr(0, rest.find('/')).find('@') != std::string_view::npos) {
    return bad("holds a user or a password", "put them into user and secret");
  }
  const bool printable =
      std::ranges::all_of(rest, [](unsigned char c) { return c > 32 && c < 127; });
  if (!printable || rest.find_first_of("?#") != std::string_view::npos) {
    return bad("has characters that an address can't have (blanks, ?, #)");
  }
  return {};
}

bool is_ae_title(std::string_view title) {
  return title.size() <= 16 && std::ranges::all_of(title, [](unsigned char c) {
           return c >= 32 && c < 127 && c != '\\';
         });
}

/// Minutes of the day of both ends of "20:00-06:00"; nothing if it is none.
std::optional<std::pair<int, int>> minutes_of(const std::string& hours) {
  int from_h = 0, from_m = 0, to_h = 0, to_m = 0, read = 0;
  if (std::sscanf(hours.c_str(), "%2d:%2d-%2d:%2d%n", &from_h, &from_m, &to_h, &to_m, &read) != 4 ||
      static_cast<std::size_t>(read) != hours.size()) {
    return std::nullopt;
  }
  for (const int h : {from_h, to_h}) {
    if (h < 0 || h > 24) return std::nullopt;
  }
  for (const int m : {from_m, to_m}) {
    if (m < 0 || m > 59) return std::nullopt;
  }
  return std::pair{from_h * 60 + from_m, to_h * 60 + to_m};
}

}  // namespace

const char* to_string(DeliveryProtocol protocol) {
  constexpr std::array names{"folder", "webdav", "s3", "sftp", "dicom", "stow", "fhir"};
  return names[static_cast<std::size_t>(protocol)];
}

Result<void> TargetConfig::validate() const {
  const auto bad = [](std::string key, std::string what, std::string advice = {}) {
    return fail(ErrorKind::bad_input, std::move(key), std::move(what), std::move(advice));
  };
  const bool good_name = !name.empty() && std::ranges::all_of(name, [](unsigned char c) {
    return std::isalnum(c) != 0 || c == '-' || c == '_';
  });
  if (!good_name) return bad("name", "must be letters, digits, - and _ only");
  const ProtocolKeys& keys = keys_of(protocol);
  if (auto sound = check_address(*this, keys); !sound) return sound;
  for (const auto& [key, given] : given_keys(*this)) {
    if (!given && contains(keys.needed, key)) {
      return bad(std::string(key), fmt::format("is needed for {}", to_string(protocol)));
    }
    if (given && !contains(keys.needed, key) && !contains(keys.known, key)) {
      return bad(std::string(key), fmt::format("means nothing for {}", to_string(protocol)),
                 "remove it");
    }
  }
  if (protocol == sftp && secret.empty() == key_file.empty()) {
    return bad("key_file", "or secret (a password), one of the two, is needed for sftp");
  }
  if (protocol == sftp &&
      (!host_key_sha256.starts_with("SHA256:") || host_key_sha256.size() != 50)) {
    return bad("host_key_sha256", "must be SHA256: and 43 characters",
               "as `ssh-keygen -lf ssh_host_ed25519_key.pub` prints it at the receiver");
  }
  if (protocol != sftp && certificate_file.empty() != key_file.empty()) {
    return bad("certificate_file", "and key_file need each other");
  }
  if ((protocol == webdav || protocol == stow || protocol == fhir) && !user.empty() &&
      secret.empty()) {
    return bad("secret", "is needed with user");
  }
  if (address.starts_with("dicoms://") && ca_file.empty()) {
    return bad("ca_file", "is needed for dicoms://",
               "it must vouch for this receiver only: DICOM's TLS does not compare names");
  }
  for (const auto& [key, title] : {std::pair{"called_ae", called_ae}, {"calling_ae", calling_ae}}) {
    if (!is_ae_title(title)) return bad(key, "must be at most 16 ASCII characters without \\");
  }
  if (max_photographs && *max_photographs < 0) return bad("max_photographs", "must be 0 or more");
  if (!hours.empty() && !minutes_of(hours)) {
    return bad("hours", "must be like \"20:00-06:00\" (UTC)");
  }
  return {};
}

bool TargetConfig::open_at(UtcTime time) const {
  const auto limits = minutes_of(hours);
  if (!limits) return true;
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const auto minute = std::chrono::duration_cast<std::chrono::minutes>(time - day).count();
  const auto [from, to] = *limits;
  return from <= to ? from <= minute && minute < to : from <= minute || minute < to;
}

}  // namespace skullstation
