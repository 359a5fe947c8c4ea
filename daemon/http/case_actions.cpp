#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "daemon/delivery/delivery_json.h"
#include "daemon/http/actions.h"
#include "daemon/service/sealed_cases.h"
#include "daemon/service/service_json.h"

namespace skullstation::actions {

namespace {

using Json = nlohmann::ordered_json;

std::string text_of(const Json& json) {
  return json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

int number_in(const Call& call, const std::string& key, int low, int high, int otherwise) {
  const auto found = call.request.query.find(key);
  if (found == call.request.query.end()) return otherwise;
  int value = otherwise;
  const std::string& text = found->second;
  std::from_chars(text.data(), text.data() + text.size(), value);
  return std::clamp(value, low, high);
}

/// The case of the path, its number for the audit log; or that there is none.
Result<Case> case_in(Console& console, Call& call) {
  auto found = console.service.store().case_of(call.number("case"));
  if (found) call.subject = found->number;
  return found;
}

Result<Job> job_in(Console& console, Call& call) {
  auto found = console.service.store().job(call.number("job"));
  if (!found) return found;
  const auto owner = console.service.store().case_of(found->case_id);
  if (owner) call.subject = owner->number;
  call.details["job"] = found->id;
  call.details["step"] = found->step;
  return found;
}

Result<Delivery> delivery_in(Console& console, Call& call) {
  auto found = console.service.outbox().find(call.number("delivery"));
  if (!found) return found;
  call.subject = found->case_number;
  call.details["delivery"] = found->id;
  call.details["target"] = found->target;
  return found;
}

Response not_found(const Error& error) {
  // The only usage error of a look-up is that there is nothing.
  return error.kind == ErrorKind::usage ? refusal(404, "not_found", error.message())
                                        : refusal(error);
}

template <class T>
Response outcome(const Result<T>& done) {
  return done ? json_answer(200, R"({"done":true})") : refusal(done.error());
}

Json whole_job(const Job& job, const std::optional<Approval>& approval) {
  Json json = job_json(job);
  json["created"] = job.created;
  json["started"] = job.started;
  json["ended"] = job.ended;
  json["log"] = job.log;
  json["figures"] = job.figures.empty() ? Json() : Json::parse(job.figures, nullptr, false);
  json["inputs"] = job.inputs;
  if (approval) {
    json["approved"] = {{"by", approval->by}, {"time", approval->time}, {"note", approval->note}};
  }
  return json;
}

std::string content_type_of(const std::string& path) {
  static const std::map<std::string, std::string> types = {{".json", "application/json"},
                                                           {".html", "text/html; charset=utf-8"},
                                                           {".pdf", "application/pdf"},
                                                           {".png", "image/png"},
                                                           {".jpg", "image/jpeg"},
                                                           {".glb", "model/gltf-binary"},
                                                           {".csv", "text/csv; charset=utf-8"}};
  const auto found = types.find(std::filesystem::path(path).extension().string());
  return found == types.end() ? "application/octet-stream" : found->second;
}

}  // namespace

Response cases(Console& console, Call& call) {
  CaseSearch search;
  if (const auto words = call.request.query.find("search"); words != call.request.query.end()) {
    search.number = words->second;
  }
  search.most = number_in(call, "most", 1, 200, 50);
  search.skipped = number_in(call, "skip", 0, INT32_MAX, 0);
  const auto found = console.service.store().find_cases(search);
  if (!found) return refusal(found.error());
  Json list = Json::array();
  for (const Case& row : found->cases) list.push_back(case_json(console.service, row));
  return json_answer(200, text_of({{"cases", list}, {"all", found->all}}));
}

Response show_case(Console& console, Call& call) {
  CaseStore& store = console.service.store();
  const auto row = case_in(console, call);
  if (!row) return not_found(row.error());
  const auto jobs = store.jobs(row->id);
  if (!jobs) return refusal(jobs.error());
  Json json = case_json(console.service, *row);
  json["jobs"] = Json::array();
  for (const Job& job : *jobs) {
    const auto approval = console.approvals.of(job.id);
    if (!approval) return refusal(approval.error());
    json["jobs"].push_back(whole_job(job, *approval));
  }
  const auto deliveries = deliveries_of(store, console.service.outbox(), row->id);
  if (!deliveries) return refusal(deliveries.error());
  json["deliveries"] = Json::array();
  for (const Delivery& delivery : *deliveries) {
    json["deliveries"].push_back(delivery_json(delivery));
  }
  json["targets"] = Json::array();
  for (const TargetConfig& target : console.service.config().delivery.targets) {
    if (target.enabled) json["targets"].push_back(target.name);
  }
  const auto events = store.events(row->id);
  if (!events) return refusal(events.error());
  json["events"] = Json::array();
  for (const CaseEvent& event : *events) {
    json["events"].push_back({{"time", event.time}, {"what", event.what}});
  }
  return json_answer(200, text_of(json));
}

Response rerun(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const std::string step = body.text("step");
  const nlohmann::json* options = body.require("options");
  if (options != nullptr && !options->is_object()) body.fault("options", "must be an object");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  const auto row = case_in(console, call);
  if (!row) return not_found(row.error());
  if (step == seal_step) {
    return refusal(409, "not_now", "a result is sealed once; a new one when it is approved");
  }
  call.details["step"] = step;
  call.details["options"] = *options;
  const auto job =
      console.service.store().rerun(row->id, step, options->dump(), console.service.chain());
  if (!job) return refusal(job.error());
  console.service.engine().wake();
  return json_answer(201, text_of({{"job", *job}}));
}

Response hold(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const auto reason = body.optional_text("reason");
  if (reason && (reason->empty() || reason->size() > 500)) {
    body.fault("reason", "must have 1 to 500 characters; null lets the case go");
  }
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  const auto row = case_in(console, call);
  if (!row) return not_found(row.error());
  call.details["reason"] = reason ? Json(*reason) : Json();
  return outcome(console.service.store().set_hold(row->id, reason));
}

Response prioritise(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const int priority = body.integer("priority", -100, 100);
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  const auto row = case_in(console, call);
  if (!row) return not_found(row.error());
  call.details["priority"] = priority;
  const auto set = console.service.store().set_priority(row->id, priority);
  console.service.engine().wake();
  return outcome(set);
}

Response approve(Console& console, Call& call) {
  JsonObject body(call.body, "", call.faults);
  const int job_id = body.integer("job", 1, INT32_MAX);
  const std::string note = body.optional_text("note").value_or("");
  if (note.size() > 2000) body.fault("note", "must have 2000 characters at most");
  body.finish();
  if (auto faulty = call.faulty()) return *faulty;
  CaseStore& store = console.service.store();
  const auto row = case_in(console, call);
  if (!row) return not_found(row.error());
  const auto jobs = store.jobs(row->id);
  if (!jobs) return refusal(jobs.error());
  const std::vector<Job> current = current_jobs(*jobs);
  const auto job = std::ranges::find(current, job_id, &Job::id);
  // What somebody looked at may have been made anew meanwhile.
  if (job == current.end() || job->step != result_step || job->state != JobState::done) {
    return refusal(409, "not_now", fmt::format("job {} is not this case's present result", job_id));
  }
  call.details["job"] = job_id;
  call.details["note"] = note;
  const auto approved = console.approvals.approve(job_id, call.who.account, note);
  if (!approved) return refusal(approved.error());
  return outcome(console.service.seal(job_id, call.who.account));
}

Response retry(Console& console, Call& call) {
  const auto job = job_in(console, call);
  if (!job) return not_found(job.error());
  const auto done = console.service.store().retry(job->id);
  console.service.engine().wake();
  return outcome(done);
}

Response cancel_job(Console& console, Call& call) {
  const auto job = job_in(console, call);
  if (!job) return not_found(job.error());
  return outcome(console.service.engine().cancel(job->id));
}

Response retry_delivery(Console& console, Call& call) {
  const auto row = delivery_in(console, call);
  if (!row) return not_found(row.error());
  return outcome(console.service.outbox().retry(row->id));
}

Response hold_delivery(Console& console, Call& call) {
  const auto row = delivery_in(console, call);
  if (!row) return not_found(row.error());
  return outcome(console.service.outbox().hold(row->id));
}

Response files(Console& console, Call& call) {
  const auto job = job_in(console, call);
  if (!job) return not_found(job.error());
  const auto all = console.service.store().files(job->id);
  if (!all) return refusal(all.error());
  Json list = Json::array();
  for (const ArtifactFile& file : *all) {
    list.push_back({{"path", file.path}, {"bytes", file.bytes}, {"sha256", file.sha256}});
  }
  return json_answer(200, text_of({{"files", list}}));
}

Response file(Console& console, Call& call) {
  const std::string& path = call.parts.at("path");
  // The path is looked up among the artifact's files; it never touches the disk.
  const auto all = console.service.store().files(call.number("job"));
  if (!all) return refusal(all.error());
  const auto found = std::ranges::find(*all, path, &ArtifactFile::path);
  if (found == all->end()) return refusal(404, "not_found", "this job has no such file");
  const std::string tag = fmt::format("\"{}\"", found->sha256);
  Response response;
  response.headers = {
      {"Content-Type", content_type_of(path)},
      {"ETag", tag},
      {"Accept-Ranges", "bytes"},
      {"Cache-Control", "private, no-cache"},
      // Whatever a file says, it runs nothing and fetches nothing; a report may be shown in a
      // frame.
      {"Content-Security-Policy",
       "sandbox; default-src 'none'; img-src data:; style-src 'unsafe-inline'; frame-ancestors "
       "'self'"}};
  if (call.request.header("if-none-match") == tag) {
    response.status = 304;
    return response;
  }
  FilePart part{console.service.store().blob(*found), 0, found->bytes};
  const std::string condition = call.request.header("if-range");
  if (condition.empty() || condition == tag) {
    const RangeAsked range = parse_range(call.request.header("range"), found->bytes);
    if (!range.satisfiable) {
      Response refused = refusal(416, "range", "the file is shorter");
      refused.headers.emplace_back("Content-Range", fmt::format("bytes */{}", found->bytes));
      return refused;
    }
    if (range.begin_and_bytes) {
      std::tie(part.begin, part.bytes) = *range.begin_and_bytes;
      response.status = 206;
      response.headers.emplace_back(
          "Content-Range",
          fmt::format("bytes {}-{}/{}", part.begin, part.begin + part.bytes - 1, found->bytes));
    }
  }
  response.file = part;
  return response;
}

}  // namespace skullstation::actions
