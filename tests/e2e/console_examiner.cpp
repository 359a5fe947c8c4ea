#include "tests/e2e/console_examiner.h"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

namespace skullstation::testing {

using nlohmann::json;

void Examiner::at_the_table() {
  const json station = get("/station");
  if (station.is_null()) return;
  const std::string state = station["state"];
  if (state == "scanning") {
    const json scan = get("/station/scan");
    if (!scan.is_null()) {
      std::size_t& views = told_.views[scan["case"].get<std::int64_t>()];
      views = std::max(views, scan["views"].size());
    }
  } else if (state == "turn-over") {
    change("POST", "/station/confirm", "confirm placement");
  } else if (state == "fault") {
    change("POST", "/station/reset", "reset station");
  } else if (state != "starting" && standing_ < cases_wanted_ && waiting_ < 3) {
    const std::string number = fmt::format("case-{}", started_);
    if (change("POST", "/station/start", "start scan", {{"case_number", number}})) ++started_;
  }
}

void Examiner::with_a_case() {
  const json all = get("/cases?most=200");
  if (all.is_null()) return;
  waiting_ = 0;
  standing_ = 0;
  all_ended_ = true;
  std::vector<json> saved;
  for (const json& row : all["cases"]) {
    const std::string state = row["state"];
    // A scan that was killed before its first picture is cancelled; another one takes its place.
    if (state != "cancelled") ++standing_;
    if (state != "done" && state != "cancelled") all_ended_ = false;
    if (state == "scanning" || state == "cancelled") continue;
    if (state == "building") ++waiting_;
    told_.saved[row["id"].get<std::int64_t>()] = row["number"];
    saved.push_back(row);
  }
  all_ended_ = all_ended_ && standing_ >= cases_wanted_;
  if (saved.empty()) return;
  const json shown =
      get(fmt::format("/cases/{}", saved[random_.below(saved.size())]["id"].get<std::int64_t>()));
  if (shown.is_null()) return;
  for (const json& job : shown["jobs"]) look_at(job);
  do_something_with(shown);
}

void Examiner::look_at(const json& job) {
  const std::int64_t id = job["id"];
  if (job["state"] == "failed") change("POST", fmt::format("/jobs/{}/retry", id), "retry job");
  if (job["state"] != "done" || told_.artifacts.contains(id)) return;
  const json files = get(fmt::format("/jobs/{}/files", id));
  if (!files.is_null()) told_.artifacts[id] = files["files"];
}

void Examiner::do_something_with(const json& shown) {
  const std::int64_t id = shown["id"];
  const std::string path = fmt::format("/cases/{}", id);
  std::int64_t result = 0;
  for (const json& job : shown["jobs"]) {
    if (job["step"] == "approximate") result = job["id"];
  }
  switch (random_.below(6)) {
    case 0: {
      told_.holds.erase(id);  // without an answer nobody knows
      const std::string reason = fmt::format("reason {}", random_.below(1000));
      if (change("PUT", path + "/hold", "hold case", {{"reason", reason}})) {
        told_.holds[id] = reason;
      }
      return;
    }
    case 1:
      if (change("POST", path + "/approval", "approve case", {{"job", result}})) {
        told_.approved.insert(result);
      }
      return;
    case 2: {
      if (shown["state"] != "done" || told_.reruns.size() >= told_.saved.size()) return;
      const HttpsAnswer answer =
          ask("POST", path + "/rerun",
              {{"step", "approximate"}, {"options", {{"mark", fmt::to_string(result)}}}});
      if (answer.status == 201) {
        told_.reruns[json::parse(answer.body)["job"].get<std::int64_t>()] = id;
        ++told_.audit["rerun step"];
      }
      return;
    }
    default: return;
  }
}

}  // namespace skullstation::testing
