#include "daemon/service/control_commands.h"

#include <charconv>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/service/service_json.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Json failure(const std::string& words) { return {{"error", words}}; }
Json outcome(const Result<void>& result) {
  return result ? Json{{"ok", true}} : failure(result.error().message());
}
Json told(StationService& service, StationEvent event) {
  service.tell(event);
  return {{"ok", true}};
}

std::int64_t number_in(const std::string& text) {
  std::int64_t value = -1;
  const auto end = std::from_chars(text.data(), text.data() + text.size(), value);
  return end.ec == std::errc{} && end.ptr == text.data() + text.size() ? value : -1;
}

Json cases(StationService& service) {
  const auto all = service.store().cases();
  if (!all) return failure(all.error().message());
  Json list = Json::array();
  for (const Case& row : *all) list.push_back(case_json(service, row));
  return {{"cases", list}};
}

Json jobs(StationService& service, std::int64_t case_id) {
  const auto all = service.store().jobs(case_id);
  if (!all) return failure(all.error().message());
  Json list = Json::array();
  for (const Job& job : *all) list.push_back(job_json(job));
  return {{"jobs", list}};
}

Json files(StationService& service, std::int64_t job) {
  const auto all = service.store().files(job);
  if (!all) return failure(all.error().message());
  Json list = Json::array();
  for (const ArtifactFile& file : *all) {
    list.push_back({{"path", file.path},
                    {"bytes", file.bytes},
                    {"sha256", file.sha256},
                    {"blob", service.store().blob(file).string()}});
  }
  return {{"files", list}};
}

Json answer(StationService& service, const std::string& word, const std::string& rest) {
  const std::int64_t id = number_in(rest);
  CaseStore& store = service.store();
  if (word == "status") return status_json(service);
  if (word == "cases") return cases(service);
  if (word == "jobs") return jobs(service, id);
  if (word == "files") return files(service, id);
  if (word == "cancel-job") return outcome(service.engine().cancel(id));
  if (word == "retry") {
    const auto done = store.retry(id);
    service.engine().wake();
    return outcome(done);
  }
  if (word == "number") {
    service.set_case_number(rest);
    return {{"ok", true}};
  }
  if (word == "go") return told(service, StationEvent::go);
  if (word == "cancel") return told(service, StationEvent::cancel);

  SimulatedStation* hands = service.simulated();
  const std::map<std::string, std::function<void(SimulatedStation&)>> simulated = {
      {"press", [](SimulatedStation& s) { s.press_button(std::chrono::milliseconds(100)); }},
      {"hold", [](SimulatedStation& s) { s.press_button(std::chrono::milliseconds(1700)); }},
      {"press-stop", [](SimulatedStation& s) { s.press_estop(); }},
      {"release-stop", [](SimulatedStation& s) { s.release_estop(); }}};
  const auto hand = simulated.find(word);
  if (hand == simulated.end()) return failure("unknown word \"" + word + "\"");
  if (hands == nullptr) return failure(word + " needs a simulated station that is open");
  hand->second(*hands);
  return {{"ok", true}};
}

}  // namespace

std::string answer_control(StationService& service, const std::string& line) {
  std::istringstream in(line);
  std::string word;
  std::string rest;
  in >> word >> std::ws;
  std::getline(in, rest);
  return answer(service, word, rest).dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace skullstation
