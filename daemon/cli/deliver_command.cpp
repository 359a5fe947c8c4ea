#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/nearest_word.h"
#include "daemon/cli/commands.h"
#include "daemon/delivery/delivery.h"
#include "daemon/delivery/delivery_json.h"
#include "daemon/evidence/package_check.h"
#include "daemon/station/station_config.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Result<TargetConfig> target_named(const StationConfig& config, const std::string& name) {
  std::vector<std::string> names;
  for (const TargetConfig& target : config.delivery.targets) {
    if (target.name == name) return target;
    names.push_back(target.name);
  }
  const std::string near = nearest_word(name, names);
  return fail(ErrorKind::usage, "target " + name, "is not in the configuration",
              names.empty()  ? "add it as [[delivery.targets]] (docs/delivery.md)"
              : near.empty() ? fmt::format("known: {}", fmt::join(names, ", "))
                             : fmt::format("did you mean {}?", near));
}

std::string line_of(const Delivery& d) {
  std::string line = fmt::format("{:>5}  {:<9}  {:<16}  {:<16}", d.id, to_string(d.state), d.target,
                                 d.case_number);
  if (d.delivered) line += fmt::format("  {}, read back and equal", *d.delivered);
  if (d.next_time) line += fmt::format("  again at {} (attempt {})", *d.next_time, d.attempts + 1);
  if (d.state != DeliveryState::delivered && d.last_error) line += "\n         " + *d.last_error;
  return line + "\n";
}

std::string oldest_in_words(const std::optional<Delivery>& oldest) {
  if (!oldest) return "everything is delivered\n";
  return fmt::format("oldest that is not delivered: {} to {}, since {}, {}\n", oldest->case_number,
                     oldest->target, oldest->created, to_string(oldest->state));
}

/// 0: all delivered; what needs a person weighs more than what goes on by itself.
int exit_code_of(const std::vector<Delivery>& deliveries) {
  bool on_its_way = false;
  for (const Delivery& d : deliveries) {
    if (d.state == DeliveryState::rejected || d.state == DeliveryState::held) {
      return exit_code(ErrorKind::bad_input);
    }
    on_its_way = on_its_way || d.state != DeliveryState::delivered;
  }
  return on_its_way ? exit_code(ErrorKind::hardware) : 0;
}

Result<SenderOptions> options_of(const StationConfig& config) {
  return sender_options(config.delivery.targets, config.evidence.audit_log,
                        config.evidence.keys_folder, config.station_id, "skullstation deliver");
}

/// Sends what has one of the ids and tells what has become of it.
Result<CommandReport> send_now(Outbox& outbox, const SenderOptions& options,
                               const std::vector<std::int64_t>& ids, const Progress& progress) {
  const auto sent = send_due(outbox, options, SystemClock(), progress, ids);
  if (!sent) return forward(sent);
  CommandReport report;
  if (!*sent) report.text = "another program sends from this outbox just now and will send it\n";
  std::vector<Delivery> rows;
  Json list = Json::array();
  for (const std::int64_t id : ids) {
    const auto row = outbox.find(id);
    if (!row) return forward(row);
    report.text += line_of(*row);
    list.push_back(delivery_json(*row));
    rows.push_back(*row);
  }
  report.json = Json{{"deliveries", list}}.dump(2, ' ', false, Json::error_handler_t::replace);
  report.exit_code = exit_code_of(rows);
  return report;
}

Result<std::unique_ptr<Outbox>> open_outbox(const StationConfig& config) {
  static const SystemClock clock;
  return Outbox::open(config.delivery.folder, clock);
}

}  // namespace

Result<CommandReport> run(const DeliverTestCommand& command, const CommonOptions&,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const auto target = target_named(*config, command.target);
  if (!target) return forward(target);
  const auto work = std::filesystem::path(config->delivery.folder) / "work" /
                    fmt::format("probe-{}", target->name);
  const auto probed = try_target(*target, config->station_id, work, progress);
  if (!probed) return forward(probed);
  CommandReport report;
  report.text =
      fmt::format("{}: a probe was sent, read back and equal{}\n", target->name,
                  probed->removed ? ", and removed again"
                                  : fmt::format("; it stays there ({} can't remove): {}",
                                                to_string(target->protocol), probed->object));
  report.json = Json{{"target", target->name},
                     {"protocol", to_string(target->protocol)},
                     {"object", probed->object},
                     {"removed", probed->removed}}
                    .dump(2);
  return report;
}

Result<CommandReport> run(const DeliverListCommand& command, const CommonOptions&,
                          const Progress&) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const auto outbox = open_outbox(*config);
  if (!outbox) return forward(outbox);
  const auto rows = (*outbox)->list();
  if (!rows) return forward(rows);
  const auto oldest = (*outbox)->oldest_undelivered();
  if (!oldest) return forward(oldest);
  CommandReport report;
  Json list = Json::array();
  for (const Delivery& row : *rows) {
    report.text += line_of(row);
    list.push_back(delivery_json(row));
  }
  report.text += oldest_in_words(*oldest);
  report.json = Json{{"deliveries", list},
                     {"oldest_undelivered", *oldest ? delivery_json(**oldest) : Json(nullptr)}}
                    .dump(2, ' ', false, Json::error_handler_t::replace);
  return report;
}

Result<CommandReport> run(const DeliverRetryCommand& command, const CommonOptions&,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const auto outbox = open_outbox(*config);
  if (!outbox) return forward(outbox);
  const auto row = (*outbox)->find(command.id);
  if (!row) return forward(row);
  const auto options = options_of(*config);
  if (!options) return forward(options);
  // What is queued needs no decision, only a sender.
  if (row->state != DeliveryState::queued) {
    if (const auto queued = (*outbox)->retry(command.id); !queued) return forward(queued);
  }
  return send_now(**outbox, *options, {command.id}, progress);
}

Result<CommandReport> run(const DeliverHoldCommand& command, const CommonOptions&,
                          const Progress&) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  const auto outbox = open_outbox(*config);
  if (!outbox) return forward(outbox);
  const auto held = (*outbox)->hold(command.id);
  if (!held) return forward(held);
  CommandReport report;
  report.text = line_of(*held);
  report.json = delivery_json(*held).dump(2, ' ', false, Json::error_handler_t::replace);
  return report;
}

Result<CommandReport> run(const DeliverSendCommand& command, const CommonOptions&,
                          const Progress& progress) {
  const auto config = read_config(command.config);
  if (!config) return forward(config);
  std::vector<std::string> names;
  for (const std::string& name : command.targets) {
    if (const auto target = target_named(*config, name); !target) return forward(target);
    names.push_back(name);
  }
  if (names.empty()) {
    for (const TargetConfig& target : config->delivery.targets) {
      if (target.enabled) names.push_back(target.name);
    }
  }
  if (names.empty()) {
    return fail(ErrorKind::usage, command.config.string(), "has no target that is enabled",
                "add one as [[delivery.targets]] (docs/delivery.md)");
  }
  const auto options = options_of(*config);
  if (!options) return forward(options);
  const auto check = check_package(command.package, {}, progress.part(0.0, 0.2));
  if (!check) return forward(check);
  if (!check->findings.empty()) {
    return fail(ErrorKind::bad_input, command.package.string(),
                fmt::format("is not as it was sealed ({}: {})", check->findings.front().file,
                            check->findings.front().what),
                "nothing was sent; `skullstation verify` tells more");
  }
  const auto package = read_sealed_package(command.package);
  if (!package) return forward(package);
  const auto outbox = open_outbox(*config);
  if (!outbox) return forward(outbox);
  std::vector<std::int64_t> ids;
  for (const std::string& name : names) {
    const auto row = (*outbox)->add(*package, name);
    if (!row) return forward(row);
    ids.push_back(row->id);
  }
  return send_now(**outbox, *options, ids, progress.part(0.2, 1.0));
}

}  // namespace skullstation
