#include "daemon/http/message.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

namespace skullstation {

namespace {

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

tl::unexpected<Error> bad_target(std::string what) {
  return fail(ErrorKind::bad_input, "address", std::move(what));
}

Result<std::string> decoded(std::string_view text, bool plus_is_space) {
  std::string plain;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '%') {
      const int high = i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hex_digit(text[i + 2]) : -1;
      if (high < 0 || low < 0) return bad_target("has a % without two hexadecimal digits");
      plain += static_cast<char>(16 * high + low);
      i += 2;
    } else {
      plain += plus_is_space && text[i] == '+' ? ' ' : text[i];
    }
  }
  if (!is_utf8(plain)) return bad_target("is not UTF-8");
  if (std::ranges::any_of(plain, [](unsigned char c) { return c < 0x20 || c == 0x7f; })) {
    return bad_target("has control characters");
  }
  return plain;
}

Result<void> check_path(std::string_view path) {
  if (path.empty() || path[0] != '/') return bad_target("must begin with a slash");
  for (std::size_t begin = 1; begin < path.size();) {
    const std::size_t end = std::min(path.find('/', begin), path.size());
    const std::string_view part = path.substr(begin, end - begin);
    if (part.empty() || part == "." || part == "..") return bad_target("has an empty part or dots");
    begin = end + 1;
  }
  return {};
}

const char* reason_of(unsigned status) {
  switch (status) {
    case 200: return "OK";
    case 201: return "Created";
    case 202: return "Accepted";
    case 204: return "No Content";
    case 206: return "Partial Content";
    case 304: return "Not Modified";
    case 400: return "Bad Request";
    case 401: return "Unauthorized";
    case 403: return "Forbidden";
    case 404: return "Not Found";
    case 405: return "Method Not Allowed";
    case 409: return "Conflict";
    case 413: return "Payload Too Large";
    case 415: return "Unsupported Media Type";
    case 416: return "Range Not Satisfiable";
    case 422: return "Unprocessable Entity";
    case 429: return "Too Many Requests";
    case 431: return "Request Header Fields Too Large";
    case 503: return "Service Unavailable";
    default: return "Internal Server Error";
  }
}

std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || end.ec != std::errc{} || end.ptr != text.data() + text.size()) return {};
  return value;
}

/// One line of a header: an error message that came from outside must not begin another one.
std::string one_line(std::string_view value) {
  std::string line(value);
  std::ranges::replace_if(
      line, [](unsigned char c) { return c < 0x20 || c == 0x7f; }, ' ');
  return line;
}

}  // namespace

std::string Request::header(const std::string& name) const {
  const auto found = headers.find(name);
  return found == headers.end() ? std::string{} : found->second;
}

Result<RequestTarget> parse_target(std::string_view target) {
  RequestTarget parsed;
  const std::size_t question = target.find('?');
  // Checked before it is decoded as well: "%2e%2e" is as little wanted as "..".
  auto path = decoded(target.substr(0, question), false);
  if (!path) return forward(path);
  if (auto sound = check_path(*path); !sound) return forward(sound);
  parsed.path = *std::move(path);
  if (question == std::string_view::npos) return parsed;
  std::string_view rest = target.substr(question + 1);
  while (!rest.empty()) {
    const std::string_view pair = rest.substr(0, rest.find('&'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    const std::size_t equals = pair.find('=');
    const auto key = decoded(pair.substr(0, equals), true);
    const auto value = decoded(
        equals == std::string_view::npos ? std::string_view{} : pair.substr(equals + 1), true);
    if (!key) return forward(key);
    if (!value) return forward(value);
    parsed.query[*key] = *value;
  }
  return parsed;
}

std::string cookie_of(const Request& request, std::string_view name) {
  const std::string all = request.header("cookie");
  std::string_view rest = all;
  while (!rest.empty()) {
    std::string_view pair = rest.substr(0, rest.find(';'));
    rest.remove_prefix(std::min(pair.size() + 1, rest.size()));
    while (!pair.empty() && pair.front() == ' ') pair.remove_prefix(1);
    const std::size_t equals = pair.find('=');
    if (equals != std::string_view::npos && pair.substr(0, equals) == name) {
      return std::string(pair.substr(equals + 1));
    }
  }
  return {};
}

RangeAsked parse_range(std::string_view header, std::uint64_t bytes) {
  constexpr std::string_view unit = "bytes=";
  if (!header.starts_with(unit)) return {};
  header.remove_prefix(unit.size());
  const std::size_t dash = header.find('-');
  if (dash == std::string_view::npos) return {};
  const auto first = whole_number(header.substr(0, dash));
  const auto last = whole_number(header.substr(dash + 1));
  if (first && (last || header.size() == dash + 1)) {
    if (last && *last < *first) return {};
    if (*first >= bytes) return {false, {}};
    const std::uint64_t end = last ? std::min(*last, bytes - 1) : bytes - 1;
    return {true, std::pair{*first, end - *first + 1}};
  }
  if (dash == 0 && last) {  // the last so many bytes
    if (*last == 0 || bytes == 0) return {false, {}};
    const std::uint64_t wanted = std::min(*last, bytes);
    return {true, std::pair{bytes - wanted, wanted}};
  }
  return {};
}

std::string head_of(const Response& response, bool keep_alive) {
  std::string head = fmt::format("HTTP/1.1 {} {}\r\n", response.status, reason_of(response.status));
  bool has_policy = false;
  bool has_cache = false;
  for (const auto& [name, value] : response.headers) {
    head += fmt::format("{}: {}\r\n", name, one_line(value));
    has_policy = has_policy || name == "Content-Security-Policy";
    has_cache = has_cache || name == "Cache-Control";
  }
  if (response.events == nullptr && response.status != 204 && response.status != 304) {
    head += fmt::format("Content-Length: {}\r\n",
                        response.file ? response.file->bytes : response.body.size());
  }
  if (!has_policy)
    head += "Content-Security-Policy: default-src 'none'; frame-ancestors 'none'\r\n";
  if (!has_cache) head += "Cache-Control: no-store\r\n";
  head +=
      "X-Content-Type-Options: nosniff\r\n"
      "Referrer-Policy: no-referrer\r\n"
      "Cross-Origin-Opener-Policy: same-origin\r\n"
      "Cross-Origin-Resource-Policy: same-origin\r\n"
      "Strict-Transport-Security: max-age=31536000\r\n";
  head += keep_alive ? "Connection: keep-alive\r\n\r\n" : "Connection: close\r\n\r\n";
  return head;
}

Response json_answer(unsigned status, std::string json) {
  return {status, {{"Content-Type", "application/json; charset=utf-8"}}, std::move(json)};
}

Response refusal(unsigned status, std::string_view code, std::string_view words) {
  const nlohmann::ordered_json json = {{"error", words}, {"code", code}};
  return json_answer(status, json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
}

Response refusal(const Error& error) {
  switch (error.kind) {
    case ErrorKind::usage: return refusal(409, "not_now", error.message());
    case ErrorKind::bad_input: return refusal(422, "bad_input", error.message());
    case ErrorKind::hardware: return refusal(503, "hardware", error.message());
    case ErrorKind::no_result:
    case ErrorKind::cancelled: break;
  }
  return refusal(500, "failed", error.message());
}

bool is_utf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const auto byte = [&](std::size_t at) {
      return at < text.size() ? static_cast<unsigned char>(text[at]) : 0U;
    };
    const unsigned first = byte(i);
    const std::size_t length = first < 0x80                     ? 1
                               : first >= 0xc2 && first <= 0xdf ? 2
                               : first >= 0xe0 && first <= 0xef ? 3
                               : first >= 0xf0 && first <= 0xf4 ? 4
                                                                : 0;
    if (length == 0) return false;
    for (std::size_t k = 1; k < length; ++k) {
      if ((byte(i + k) & 0xc0) != 0x80) return false;
    }
    const unsigned second = byte(i + 1);
    const bool overlong = (first == 0xe0 && second < 0xa0) || (first == 0xf0 && second < 0x90);
    const bool surrogate = first == 0xed && second >= 0xa0;
    if (overlong || surrogate || (first == 0xf4 && second >= 0x90)) return false;
    i += length;
  }
  return true;
}

}  // namespace skullstation
