#pragma once

#include <filesystem>
#include <string>

#include "core/progress.h"
#include "core/result.h"
#include "daemon/cli/terminal.h"

namespace skullstation {

/// One step of a case, as the daemon's job engine calls it: FOLDER/request.json says what to do
/// (docs/station.md); the artifact goes to FOLDER/out, the figures to FOLDER/result.json, progress
/// to stdout, a JSON object a line.
struct StepCommand {
  std::string name;  ///< of a step in daemon/jobs/step_chain.h
  std::filesystem::path folder;
};
Result<CommandReport> run(const StepCommand&, const CommonOptions&, const Progress&);

}  // namespace skullstation
