#include "core/url_path.h"

#include <fmt/format.h>

#include <cctype>

namespace skullstation {

std::string url_path(const std::string& path) {
  std::string url;
  for (const unsigned char c : path) {
    const bool plain =
        std::isalnum(c) != 0 || c == '-' || c == '.' || c == '_' || c == '~' || c == '/';
    url += plain ? std::string(1, static_cast<char>(c)) : fmt::format("%{:02X}", c);
  }
  return url;
}

}  // namespace skullstation
