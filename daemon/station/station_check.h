#pragma once

#include <string>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/station/station.h"
#include "daemon/station/station_config.h"

namespace skullstation {

enum class Verdict { ok, warning, failure };

/// "ok", "warning", "failure"
const char* to_string(Verdict verdict);

/// Something that was looked at, and what to do about it if it is not well.
struct Finding {
  Verdict verdict = Verdict::ok;
  std::string topic;
  std::string what;
  std::string advice;
};

/// What `skullstation doctor` and the console's station page look at, in the order of looking.
class Findings {
 public:
  void ok(std::string topic, std::string what) {
    list.push_back({Verdict::ok, std::move(topic), std::move(what), {}});
  }
  void warn(std::string topic, std::string what, std::string advice) {
    list.push_back({Verdict::warning, std::move(topic), std::move(what), std::move(advice)});
  }
  void fail(std::string topic, const Error& error) {
    list.push_back({Verdict::failure, std::move(topic),
                    error.where.empty() ? error.what : error.where + ": " + error.what,
                    error.advice});
  }

  std::vector<Finding> list;
};

/// The computer: clock, space where the cases go, priority, the cameras that it knows.
void check_machine(const StationConfig& config, const std::filesystem::path& cases,
                   Findings& findings);

/// The open station: interlock, cameras (a picture of each is taken), calibrations.
void check_parts(const StationConfig& config, const Station& station, Findings& findings);

}  // namespace skullstation
