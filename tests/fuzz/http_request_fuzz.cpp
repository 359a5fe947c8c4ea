#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/session/strict_json.h"
#include "daemon/http/console.h"
#include "daemon/http/server.h"

/// Whatever comes: the request is refused with a status, or its path stays inside, a route takes it
/// or none does, its body is JSON or is refused with words.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace skullstation;
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const ReadRequest read = read_request(bytes, {});
  if (read.status != 200) {
    if (read.status < 400 || read.status > 431) __builtin_trap();
    return 0;
  }
  const Request& request = read.request;
  if (request.path.empty() || request.path[0] != '/') __builtin_trap();
  if ((request.path + "/").find("/../") != std::string::npos) __builtin_trap();
  for (const Route& route : api_routes()) {
    const auto parts = match_route(route.path, request.path);
    if (!parts) continue;
    for (const auto& [name, value] : *parts) {
      if (value.empty()) __builtin_trap();
    }
  }
  const auto range = parse_range(request.header("range"), 1000);
  if (range.begin_and_bytes &&
      range.begin_and_bytes->first + range.begin_and_bytes->second > 1000) {
    __builtin_trap();
  }
  static_cast<void>(cookie_of(request, session_cookie));
  const auto body = parse_strict_json(request.body, "body");
  if (!body && body.error().what.empty()) __builtin_trap();
  return 0;
}
