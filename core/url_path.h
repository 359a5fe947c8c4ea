#pragma once

#include <string>

namespace skullstation {

/// The path as a part of an address: everything but '/' and RFC 3986's unreserved characters
/// (letters, digits, "-._~") as %XX.
std::string url_path(const std::string& path);

}  // namespace skullstation
