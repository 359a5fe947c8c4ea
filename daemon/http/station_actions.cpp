#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "core/session/session.h"
#include "daemon/http/actions.h"
#include "daemon/service/service_json.h"

namespace skullstation::actions {

namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

Response accepted() { return json_answer(202, R"({"accepted":true})"); }

/// A command is for the state that the person saw; in another one it would mean something else.
Response command(Console& console, StationEvent event, std::initializer_list<StationState> states) {
  const StationState now = console.service.status().state;
  if (std::ranges::find(states, now) == states.end()) {
    return refusal(409, "state", fmt::format("the station is {}", to_string(now)));
  }
  console.service.tell(event, now);
  return accepted();
}

/// What may stand in reports, on labels and in file names of other systems.
bool is_case_number(const std::string& number) {
  constexpr std::size_t most = 64;
  const bool blank = std::ranges::all_of(number, [](char c) { return c == ' '; });
  const bool control =
      std::ranges::any_of(number, [](unsigned char c) { return c < 0x20 || c == 0x7f; });
  return !blank && !control && number.size() <= most && is_utf8(number);
}

}  // namespace

Response station(Console& console, Call&) {
  StationService& service = console.service;
  const StationConfig& config = service.config();
  Json json = status_json(service);
  json["station"] = config.station_id;
  json["version"] = service.version();
  json["simulated"] = service.simulated() != nullptr;
  json["passes"] = config.scan.passes;
  json["views_per_ring"] = config.scan.views_per_ring;
  Json cameras = Json::array();
  for (const CameraConfig& camera : config.cameras) {
    Json about = {{"id", camera.id}};
    if (camera.backend == CameraBackend::simulated) {
      about["elevation_deg"] = camera.simulated.elevation_deg;
    }
    cameras.push_back(about);
  }
  json["cameras"] = cameras;
  Json steps = Json::array();
  for (const StepKind& kind : service.chain()) {
    steps.push_back({{"name", kind.name}, {"options", Json::parse(kind.options, nullptr, false)}});
  }
  json["steps"] = steps;
  json["time"] = to_iso8601(service.clock().utc_now());
  return json_answer(200, text_of(json));
}

Response start(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::optional<std::string> number = body.optional_text("case_number");
  if (number && !number->empty() && !is_case_number(*number)) {
    body.fault("case_number", "must be 1 to 64 characters, none of them a control character");
  }
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  call.subject = number.value_or("");
  const StationState now = console.service.status().state;
  const bool can =
      now == StationState::ready || now == StationState::building || now == StationState::result;
  // Only then: a number that is refused must not be given to the next specimen.
  if (can) console.service.set_case_number(number.value_or(""));
  return command(console, StationEvent::go,
                 {StationState::ready, StationState::building, StationState::result});
}

Response confirm(Console& console, Call&) {
  return command(console, StationEvent::go, {StationState::turn_over});
}

Response cancel(Console& console, Call&) {
  return command(console, StationEvent::cancel,
                 {StationState::scanning, StationState::turn_over, StationState::result});
}

Response reset(Console& console, Call&) {
  return command(console, StationEvent::go, {StationState::fault});
}

Response hand(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string hand = body.text("hand");
  if (hand != "press" && hand != "hold" && hand != "press-stop" && hand != "release-stop") {
    body.fault("hand", "must be press, hold, press-stop or release-stop");
  }
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  call.details["hand"] = hand;
  SimulatedStation* hands = console.service.simulated();
  if (hands == nullptr)
    return refusal(409, "state", "only a simulated station that is open has it");
  if (hand == "press") hands->press_button(std::chrono::milliseconds(100));
  if (hand == "hold") hands->press_button(std::chrono::milliseconds(1700));
  if (hand == "press-stop") hands->press_estop();
  if (hand == "release-stop") hands->release_estop();
  return accepted();
}

Response scan_views(Console& console, Call&) {
  const StationStatus status = console.service.status();
  if (!status.scanning) return refusal(404, "not_found", "nothing is being scanned");
  Json json = {{"case", *status.scanning}, {"views", Json::array()}};
  const auto folder = console.service.store().scan_folder(*status.scanning);
  std::error_code ignored;
  // There is none before the first picture.
  if (std::filesystem::exists(folder / "session.json", ignored)) {
    const auto session = read_session(folder);
    if (!session) return refusal(session.error());
    json["number"] = session->case_number;
    for (const SessionView& view : session->views) {
      Json about = {{"camera", view.camera}, {"pass", view.pass}};
      if (view.table_angle_deg) about["angle_deg"] = *view.table_angle_deg;
      if (view.quality && view.quality->rejected) about["rejected"] = *view.quality->rejected;
      json["views"].push_back(about);
    }
  }
  return json_answer(200, text_of(json));
}

Response preview(Console& console, Call& call) {
  const auto asked = call.request.query.find("camera");
  const auto& cameras = console.service.config().cameras;
  const std::string camera = asked != call.request.query.end() ? asked->second
                             : cameras.empty()                 ? ""
                                                               : cameras.front().id;
  const auto seen = console.service.preview(camera);
  if (!seen) {
    if (seen.error().kind == ErrorKind::usage) {
      return refusal(404, "not_found", seen.error().message());
    }
    return refusal(seen.error());
  }
  const ViewQuality& quality = seen->quality;
  const QualityGates& gates = console.service.config().gates;
  Json about = {{"camera", camera},
                {"taken", seen->taken},
                {"sharpness", quality.sharpness},
                {"clipped_percent", quality.clipped_percent},
                {"dark_percent", quality.dark_percent},
                {"mean_level", quality.mean_level},
                {"mean_level_allowed", {gates.min_mean_level, gates.max_mean_level}},
                {"specimen_percent", quality.specimen_percent},
                {"border_percent", quality.border_percent},
                {"board_corners", quality.board_corners}};
  if (seen->complaint) about["complaint"] = *seen->complaint;
  return {
      200, {{"Content-Type", "image/jpeg"}, {"X-Preview", about.dump(-1, ' ', true)}}, seen->jpeg};
}

Response check(Console& console, Call&) {
  Json list = Json::array();
  for (const Finding& finding : console.service.check()) {
    list.push_back({{"verdict", to_string(finding.verdict)},
                    {"topic", finding.topic},
                    {"what", finding.what},
                    {"advice", finding.advice}});
  }
  const auto free = free_space_bytes(console.service.store().folder());
  Json json = {{"findings", list}, {"certificate_sha256", console.fingerprint}};
  if (free) json["free_bytes"] = *free;
  return json_answer(200, text_of(json));
}

Response events(Console& console, Call& call) {
  const std::string last = call.request.header("last-event-id");
  std::uint64_t line = 0;
  std::from_chars(last.data(), last.data() + last.size(), line);
  auto queue = console.events.listen(call.token, line);
  if (!queue) return refusal(503, "too_many", "too many people are watching");
  return {200, {{"Content-Type", "text/event-stream"}}, {}, {}, std::move(queue)};
}

}  // namespace skullstation::actions
