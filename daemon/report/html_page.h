#pragma once

#include <string>
#include <string_view>

#include "daemon/report/report.h"

namespace skullstation {

/// The report as an HTML page in one file, pictures and all, that any browser shows and prints
/// without a network. What HTML would take for its own is escaped.
std::string html_page(const Report& report);

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace skullstation
