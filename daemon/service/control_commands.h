#pragma once

#include <string>

#include "daemon/service/station_service.h"

namespace skullstation {

/// Answers one line of the control socket (docs/station.md lists them) with one line of JSON:
/// {"error": "…"} if it is not understood or can't be done.
std::string answer_control(StationService& service, const std::string& line);

}  // namespace skullstation
