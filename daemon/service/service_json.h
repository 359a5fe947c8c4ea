#pragma once

#include <nlohmann/json.hpp>

#include "daemon/service/station_service.h"

namespace skullstation {

// What programs are told of a station, over the control socket and over HTTP alike.

nlohmann::ordered_json status_json(StationService& service);
nlohmann::ordered_json case_json(StationService& service, const Case& row);
nlohmann::ordered_json job_json(const Job& job);

}  // namespace skullstation
