#pragma once

#include <string>
#include <string_view>

namespace skullstation {

/// A file of the console as part of the program.
struct WebAsset {
  std::string_view content_type;
  std::string_view bytes;
  std::string gzip;
  std::string sha256;
};

/// What lies at this path ("/", "/console.js"), or null. Pages are told apart behind the '#'.
const WebAsset* find_web_asset(std::string_view path);

/// The OpenAPI description of the API (daemon/http/openapi.json).
std::string_view openapi_description();

}  // namespace skullstation
