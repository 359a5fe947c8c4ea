#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.h"

namespace skullstation {

class EventQueue;

/// A request as handlers see it: no word of the library that received it.
struct Request {
  std::string method;                          ///< "GET"
  std::string path;                            ///< decoded; begins with '/', has no "." or ".."
  std::map<std::string, std::string> query;    ///< decoded; of a repeated key the last one
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;
  std::string peer;  ///< address of the client, without its port

  /// Empty if there is no such header.
  std::string header(const std::string& name) const;
};

/// Bytes of a file that is never changed.
struct FilePart {
  std::filesystem::path file;
  std::uint64_t begin = 0;
  std::uint64_t bytes = 0;
};

struct Response {
  unsigned status = 200;
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::string body = {};
  std::optional<FilePart> file = {};             ///< instead of the body
  std::shared_ptr<EventQueue> events = nullptr;  ///< instead of the body: goes on until closed
};

/// What the first line of a request names.
struct RequestTarget {
  std::string path;
  std::map<std::string, std::string> query;
};

/// Errors (bad_input): not UTF-8, control characters, a percent sign without two digits, a path
/// that does not begin with '/' or has a part ".", ".." or none between two slashes.
Result<RequestTarget> parse_target(std::string_view target);

/// The value of the cookie, or empty.
std::string cookie_of(const Request& request, std::string_view name);

/// What a Range header asks of so many bytes. Several ranges, and what is no byte range, count as
/// none, as the standard allows.
struct RangeAsked {
  bool satisfiable = true;
  std::optional<std::pair<std::uint64_t, std::uint64_t>> begin_and_bytes;  ///< absent: all
};
RangeAsked parse_range(std::string_view header, std::uint64_t bytes);

/// The status line and the headers of an answer, with those that every answer carries (no sniffing,
/// no framing, a strict content security policy where the answer brings none of its own).
std::string head_of(const Response& response, bool keep_alive);

/// An answer of JSON.
Response json_answer(unsigned status, std::string json);
/// {"error": words, "code": code}: words for people, the code for programs.
Response refusal(unsigned status, std::string_view code, std::string_view words);
/// The same for an error: usage 409, bad input 422, hardware 503, else 500.
Response refusal(const Error& error);

/// Is it UTF-8 as RFC 3629 has it?
bool is_utf8(std::string_view text);

}  // namespace skullstation
