#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "core/random.h"
#include "daemon/cli/commands.h"
#include "reconstruction/phantom/person.h"
#include "reconstruction/phantom/person_files.h"

namespace skullstation {

Result<CommandReport> run(const PhantomCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  progress.report(0.0, "canonical head");
  const PersonMaker maker(command.edge_mm, common.threads);
  int shrunk = 0;
  for (int i = 0; i < command.count; ++i) {
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, command.out.string(), "stopped by the operator");
    }
    progress.report(static_cast<double>(i) / command.count, fmt::format("person {}", i + 1));
    const PersonParameters parameters =
        draw_person(mix(common.seed, static_cast<std::uint64_t>(i)));
    const Person person = maker.make(parameters, common.threads);
    const auto folder = command.out / fmt::format("person_{:04}", i + 1);
    if (auto written = write_person(person, folder); !written) return forward(written);
    shrunk += person.bone.shrinkings > 0 || person.face.shrinkings > 0;
  }
  CommandReport report;
  report.text = fmt::format(
      "{} synthetic people in {}, of whom {} had to be moved towards the "
      "average to be sound\n",
      command.count, command.out.string(), shrunk);
  report.json = nlohmann::ordered_json{
      {"people", command.count},
      {"folder", command.out.string()},
      {"moved_towards_average",
       shrunk}}.dump(2);
  return report;
}

}  // namespace skullstation
