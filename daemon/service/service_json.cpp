#include "daemon/service/service_json.h"

#include <cmath>

namespace skullstation {

using Json = nlohmann::ordered_json;

Json status_json(StationService& service) {
  const StationStatus now = service.status();
  Json json = {
      {"state", to_string(now.state)}, {"signal", to_string(now.signal)}, {"message", now.message}};
  if (now.scanning) {
    json["scan"] = {
        {"case", *now.scanning}, {"fraction", now.scan_fraction}, {"stage", now.scan_stage}};
  }
  if (const auto step = service.engine().progress()) {
    json["job"] = {{"id", step->job},      {"case", step->case_id},
                   {"step", step->step},   {"fraction", step->fraction},
                   {"stage", step->stage}, {"seconds", std::floor(step->seconds)}};
  }
  if (const std::string trouble = service.engine().trouble(); !trouble.empty()) {
    json["trouble"] = trouble;
  }
  return json;
}

Json case_json(StationService& service, const Case& row) {
  Json json = {{"id", row.id},
               {"number", row.number},
               {"created", row.created},
               {"state", to_string(row.state)},
               {"priority", row.priority}};
  if (row.hold) json["hold"] = *row.hold;
  if (row.verified) json["verified"] = *row.verified;
  if (row.removed) json["removed"] = *row.removed;
  if (const auto damage = service.damage_of(row.id); !damage.empty()) json["damage"] = damage;
  const auto left = service.engine().time_left(row.id);
  if (row.state == CaseState::building && left && *left) json["seconds_left"] = (*left)->count();
  return json;
}

Json job_json(const Job& job) {
  return {{"id", job.id},
          {"step", job.step},
          {"state", to_string(job.state)},
          {"options", Json::parse(job.options, nullptr, false)},
          {"interruptions", job.interruptions},
          {"seconds", job.seconds},
          {"cpu_seconds", job.cpu_seconds},
          {"peak_mib", job.peak_mib},
          {"version", job.version},
          {"error", job.error}};
}

}  // namespace skullstation
