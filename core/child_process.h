#pragma once

#include <filesystem>
#include <stop_token>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Runs a program (the first argument; looked up on PATH) to its end, what it prints going to the
/// file `log`, its standard input empty. Returns its exit code; 128 plus the signal's number if it
/// died of one. A stop request ends it (SIGTERM) and gives `cancelled`. `bad_input` if it can't be
/// started.
Result<int> run_program(const std::vector<std::string>& arguments, const std::filesystem::path& log,
                        const std::stop_token& stop);

}  // namespace skullstation
