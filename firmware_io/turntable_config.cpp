#include "firmware_io/turntable_config.h"

#include <fmt/format.h>

#include <cmath>

namespace skullstation {

namespace {

Result<void> expect_within(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return fail(ErrorKind::bad_input, name,
              fmt::format("is {}; {} to {} was expected", value, low, high));
}

}  // namespace

Result<void> TurntableConfig::validate() const {
  if (auto ok = limits.validate(); !ok) return ok;
  if (auto ok = expect_within("backlash_deg", backlash_deg, 0.0, 45.0); !ok) return ok;
  if (auto ok = expect_within("home_speed_deg_s", home_speed_deg_s, 0.01, 3600.0); !ok) return ok;
  if (auto ok = expect_within("home_search_deg", home_search_deg, 1.0, 3600.0); !ok) return ok;
  return expect_within("home_offset_deg", home_offset_deg, -360.0, 360.0);
}

}  // namespace skullstation
