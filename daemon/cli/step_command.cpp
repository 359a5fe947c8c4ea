#include "daemon/cli/step_command.h"

#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <memory>
#include <new>

#include "core/file.h"
#include "core/session/strict_json.h"
#include "daemon/cli/commands.h"

namespace skullstation {

namespace {

using Json = nlohmann::json;

const Json empty_object = Json::object();

/// What FOLDER/request.json holds; mistakes are collected in `faults`.
struct Request {
  JsonObject inputs;
  JsonObject options;
  JsonObject station;
  std::filesystem::path out;
  CommonOptions common;
};

Request request_from(const Json& json, const StepCommand& command, JsonFaults& faults) {
  JsonObject root(json, "", faults);
  const auto object = [&](const char* key) {
    const Json* value = root.require(key);
    return JsonObject(value == nullptr ? empty_object : *value, key, faults);
  };
  if (root.text("format") != "skullstation-step/1") {
    root.fault("format", "must be \"skullstation-step/1\"");
  }
  if (root.text("step") != command.name) {
    root.fault("step", fmt::format("is not \"{}\", the step that was called", command.name));
  }
  Request request{object("inputs"), object("options"), object("station"), root.text("out"), {}};
  request.common.threads = root.integer("threads", 0, 1024);
  request.common.seed =
      static_cast<std::uint64_t>(root.optional_integer("seed", 0, INT64_MAX).value_or(1));
  root.finish();
  return request;
}

ReconstructCommand reconstruct_from(Request& request) {
  ReconstructCommand command;
  command.session = request.inputs.text("scan");
  command.out = request.out;
  command.quality = request.options.optional_text("quality").value_or(command.quality);
  if (command.quality != "draft" && command.quality != "standard" && command.quality != "fine") {
    request.options.fault("quality", "must be draft, standard or fine");
  }
  command.close_holes_mm =
      request.options.optional_number("close_holes_mm").value_or(command.close_holes_mm);
  return command;
}

ApproximateCommand approximate_from(Request& request) {
  ApproximateCommand command;
  command.skull = std::filesystem::path(request.inputs.text("reconstruct")) / "skull.ply";
  command.out = request.out;
  command.sex = request.options.optional_text("sex");
  if (command.sex && *command.sex != "male" && *command.sex != "female") {
    request.options.fault("sex", "must be male or female");
  }
  command.age_years = request.options.optional_number("age_years");
  command.body_mass_index = request.options.optional_number("bmi");
  command.mean_tissue = request.options.optional_flag("mean_tissue").value_or(false);
  return command;
}

PackageCommand seal_from(Request& request) {
  PackageCommand command;
  command.case_folder = request.inputs.text("approximate");
  command.session = request.inputs.text("scan");
  command.reconstruction = request.inputs.text("reconstruct");
  command.out = request.out;
  command.keys = request.station.text("keys_folder");
  command.audit_log = request.station.text("audit_log");
  command.time_stamp_url = request.station.text("time_stamp_url");
  command.by = request.options.optional_text("approved_by").value_or("skullstationd");
  return command;
}

/// Each percent and each new stage as a line.
Progress told_in_lines(const Progress& progress) {
  const auto shown = std::make_shared<std::pair<int, std::string>>(-1, "");
  return {[shown](double fraction, std::string_view stage) {
            const int percent = static_cast<int>(std::lround(100.0 * fraction));
            if (percent == shown->first && stage == shown->second) return;
            *shown = {percent, std::string(stage)};
            const Json line = {{"fraction", fraction}, {"stage", stage}};
            fmt::print("{}\n", line.dump(-1, ' ', false, Json::error_handler_t::replace));
            std::fflush(stdout);
          },
          progress.stop};
}

template <class Command>
Result<CommandReport> make(const Command& command, Request& request, const JsonFaults& faults,
                           const Progress& progress) {
  request.inputs.finish();
  request.options.finish();
  request.station.finish();
  if (faults.first()) return tl::unexpected(*faults.first());
  return run(command, request.common, told_in_lines(progress));
}

Result<CommandReport> run_step(const StepCommand& command, const Progress& progress) {
  const auto file = command.folder / "request.json";
  const auto text = read_file(file);
  if (!text) return forward(text);
  const auto json = parse_strict_json(*text, file.string());
  if (!json) return forward(json);
  JsonFaults faults(file.string());
  Request request = request_from(*json, command, faults);
  if (command.name == "reconstruct") {
    return make(reconstruct_from(request), request, faults, progress);
  }
  if (command.name == "approximate") {
    return make(approximate_from(request), request, faults, progress);
  }
  if (command.name == "seal") return make(seal_from(request), request, faults, progress);
  return fail(ErrorKind::usage, "step \"" + command.name + "\"", "is not known",
              "use one of: reconstruct, approximate, seal");
}

}  // namespace

Result<CommandReport> run(const StepCommand& command, const CommonOptions&,
                          const Progress& progress) {
  auto report = [&]() -> Result<CommandReport> {
    try {
      return run_step(command, progress);
    } catch (const std::bad_alloc&) {
      return fail(ErrorKind::no_result, "step \"" + command.name + "\"",
                  "ran out of the memory that it may use",
                  "choose a lower quality, or raise jobs.memory_mib in station.toml");
    }
  }();
  if (!report) return report;
  if (auto written = write_file_durably(command.folder / "result.json", report->json); !written) {
    return forward(written);
  }
  return report;
}

}  // namespace skullstation
