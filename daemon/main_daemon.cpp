// The `skullstationd` program: a station at work. What it does is in daemon/service.

#include <fmt/format.h>
#include <malloc.h>
#include <systemd/sd-daemon.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>

#include "daemon/cli/terminal.h"
#include "daemon/delivery/outbox_loop.h"
#include "daemon/http/audit_trail.h"
#include "daemon/http/console_server.h"
#include "daemon/service/control_commands.h"
#include "daemon/service/control_socket.h"
#include "daemon/service/sealed_cases.h"
#include "daemon/service/station_service.h"

namespace {

using namespace skullstation;

struct DaemonOptions {
  std::filesystem::path config;
  bool simulate = false;
  std::string storage;
  std::filesystem::path step_program;
  int threads = 0;
  std::uint64_t seed = 1;
};

/// The program beside this one.
std::filesystem::path skullstation_beside() {
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / "skullstation";
}

Result<ServiceOptions> service_options(const DaemonOptions& options) {
  if (options.config.empty() && !options.simulate) {
    return fail(ErrorKind::usage, "skullstationd", "has no configuration",
                "name one with --config, or try it with --simulate");
  }
  const auto config = read_config(options.config);
  if (!config) return forward(config);
  ServiceOptions service;
  service.config = *config;
  if (options.simulate) {
    service.config.backend = StationBackend::simulated;
    for (CameraConfig& camera : service.config.cameras) camera.backend = CameraBackend::simulated;
    if (options.config.empty()) service.config.storage.folder = "out/station";
  }
  if (!options.storage.empty()) service.config.storage.folder = options.storage;
  // Steps have working folders of their own: no path may depend on where the daemon was started.
  service.config.storage.folder =
      std::filesystem::absolute(service.config.storage.folder).lexically_normal().string();
  // What is done at the console is written down, with keys that are made at the first start.
  EvidenceConfig& evidence = service.config.evidence;
  const std::filesystem::path storage = service.config.storage.folder;
  evidence.keys_folder = storage / evidence.keys_folder;  // where it was relative
  if (evidence.audit_log.empty()) evidence.audit_log = storage / "audit.log";
  service.config.delivery.folder = storage / service.config.delivery.folder;
  const auto program = options.step_program.empty()
                           ? skullstation_beside()
                           : std::filesystem::absolute(options.step_program);
  service.step_command = {program.string()};
  if (options.step_program.empty()) service.step_command.emplace_back("step");
  service.version = SKULLSTATION_VERSION;
  service.threads = options.threads;
  service.seed = options.seed;
  return service;
}

void print_address(const ConsoleServer& console, const std::string& address) {
  const bool everywhere = address == "0.0.0.0" || address == "::" || address == "127.0.0.1";
  const bool is_set_up = console.setup_code().empty();
  fmt::print(stderr, "console: https://{}:{}/\n  certificate's SHA-256: {}\n",
             everywhere || !is_set_up ? "localhost" : address, console.port(),
             console.fingerprint());
  if (is_set_up) return;
  fmt::print(stderr, "  set-up code: {} (on this machine alone, until there is an account)\n",
             console.setup_code());
}

/// Sends what has been sealed.
Result<std::unique_ptr<OutboxLoop>> start_outbox(StationService& service) {
  const StationConfig& config = service.config();
  auto sender = sender_options(config.delivery.targets, config.evidence.audit_log,
                               config.evidence.keys_folder, config.station_id, "skullstationd");
  if (!sender) return forward(sender);
  sender->told = [](const Delivery& d) {
    fmt::print(stderr, "delivery {} of {} to {}: {}{}\n", d.id, d.case_number, d.target,
               to_string(d.state), d.last_error ? ", " + *d.last_error : "");
  };
  return std::make_unique<OutboxLoop>(service.outbox(), *std::move(sender), [&service] {
    return hand_over_sealed_cases(service.store(), service.outbox(),
                                  service.config().delivery.targets);
  });
}

Result<void> serve(const DaemonOptions& options, const std::stop_token& stop) {
  const auto service_with = service_options(options);
  if (!service_with) return forward(service_with);
  const auto service = StationService::open(*service_with);
  if (!service) return forward(service);
  if (const auto keys = keys_in(service_with->config.evidence.keys_folder,
                                service_with->config.station_id, SystemClock());
      !keys) {
    return forward(keys);
  }
  const std::filesystem::path socket =
      std::filesystem::path(service_with->config.storage.folder) / "control";
  const auto control = ControlSocket::open(
      socket, [&service](const std::string& line) { return answer_control(**service, line); });
  if (!control) return forward(control);
  std::unique_ptr<ConsoleServer> console;
  if (service_with->config.http.enabled) {
    auto opened = ConsoleServer::open(**service);
    if (!opened) return forward(opened);
    console = *std::move(opened);
    print_address(*console, service_with->config.http.address);
  }
  const auto outbox = start_outbox(**service);
  if (!outbox) return forward(outbox);
  fmt::print(stderr, "station {}: cases in {}\n", service_with->config.station_id,
             service_with->config.storage.folder);
  sd_notify(0, "READY=1");
  (*service)->run(stop, [] { sd_notify(0, "WATCHDOG=1"); });
  sd_notify(0, "STOPPING=1");
  return {};
}

/// Photographs come and go in many threads: without this each thread's arena keeps tens of MiB.
void give_memory_back() {
  constexpr int arenas = 2;
  constexpr int of_their_own_bytes = 1 << 20;  // larger blocks go back when they are freed
  ::mallopt(M_ARENA_MAX, arenas);
  ::mallopt(M_MMAP_THRESHOLD, of_their_own_bytes);
}

int run_program(int argc, char** argv) {
  give_memory_back();
  const StopOnSignal stop;  // before any other thread
  CLI::App app{"skullstationd: a station at work, with its button, its lamps and its jobs"};
  app.set_version_flag("--version", SKULLSTATION_VERSION);
  DaemonOptions options;
  app.add_option("--config", options.config, "station.toml");
  app.add_flag("--simulate", options.simulate,
               "without hardware: a simulated station in real time");
  app.add_option("--storage", options.storage,
                 "folder of the cases, instead of the configuration's (simulated without "
                 "configuration: out/station)");
  app.add_option("--step-program", options.step_program,
                 "makes the steps instead of `skullstation step`; for tests");
  app.add_option("--threads", options.threads, "of a step; 0: all")->check(CLI::Range(0, 1024));
  app.add_option("--seed", options.seed, "of everything random")->capture_default_str();
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    const bool asked_for_help = error.get_exit_code() == 0;
    app.exit(error);
    return asked_for_help ? 0 : exit_code(ErrorKind::usage);
  }
  const auto served = serve(options, stop.token());
  if (served) return 0;
  fmt::print(stderr, "skullstationd: {}\n", served.error().message());
  return exit_code(served.error().kind);
}

}  // namespace

int main(int argc, char** argv) {
  return skullstation::guarded("skullstationd", [&] { return run_program(argc, argv); });
}
