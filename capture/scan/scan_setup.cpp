#include "capture/scan/scan_setup.h"

#include <fmt/format.h>

#include <set>

namespace skullstation {

Result<void> ScanOptions::validate() const {
  const auto wrong = [](const char* name, std::string what) {
    return fail(ErrorKind::usage, fmt::format("scan: {}", name), std::move(what));
  };
  if (Result<void> valid = plan.validate(); !valid) return valid;
  if (Result<void> valid = gates.validate(); !valid) return valid;
  if (board) {
    if (Result<void> valid = board->validate(); !valid) return valid;
  }
  if (settle_time.count() < 0) return wrong("settle_time", "must not be negative");
  if (motion_interval.count() < 0) return wrong("motion_interval", "must not be negative");
  if (frame_timeout.count() <= 0) return wrong("frame_timeout", "must be greater than 0");
  if (max_attempts < 1 || max_attempts > 100) {
    return wrong("max_attempts", fmt::format("must be from 1 to 100, not {}", max_attempts));
  }
  return {};
}

Session wanted_session(const ScanOptions& options, const ScanStation& station) {
  Session session;
  session.created = to_iso8601(station.clock.utc_now());
  session.station = options.station;
  session.case_number = options.case_number;
  session.board = options.board;
  session.plan = options.plan.record();
  session.complete = false;
  for (const ScanCamera& camera : station.cameras) {
    SessionCamera& entry = session.cameras.emplace_back();
    entry.id = camera.id;
    if (camera.lens) entry.params = camera.lens->params(entry.model);
  }
  return session;
}

Result<void> check_cameras(const ScanPlan& plan, const std::vector<ScanCamera>& cameras) {
  std::set<std::string> ids;
  for (const ScanCamera& camera : cameras) {
    if (!ids.insert(camera.id).second) {
      return fail(ErrorKind::usage, "scan",
                  fmt::format("two cameras are called \"{}\"", camera.id));
    }
  }
  for (const SessionPlan::Ring& ring : plan.rings) {
    if (ids.erase(ring.camera) == 0) {
      return fail(ErrorKind::usage, "scan plan",
                  fmt::format("the station has no camera \"{}\"", ring.camera));
    }
  }
  if (!ids.empty()) {
    return fail(ErrorKind::usage, "scan plan",
                fmt::format("camera \"{}\" has no ring", *ids.begin()));
  }
  return {};
}

}  // namespace skullstation
