#pragma once

#include <optional>
#include <string>

#include "core/clock.h"

namespace skullstation {

/// The moment written by to_iso8601() ("2026-01-31T12:00:00.000Z"; the fraction may be absent);
/// nothing for anything else.
std::optional<UtcTime> from_iso8601(const std::string& text);

}  // namespace skullstation
