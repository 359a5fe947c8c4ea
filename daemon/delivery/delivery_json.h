#pragma once

#include <nlohmann/json.hpp>

#include "daemon/delivery/outbox.h"

namespace skullstation {

/// As programs are shown it: `deliver list --json`, the console's API.
nlohmann::ordered_json delivery_json(const Delivery& delivery);

}  // namespace skullstation
