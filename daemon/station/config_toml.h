#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "core/result.h"
#include "daemon/station/config_fields.h"

namespace skullstation {

using ConfigWalk = std::function<void(ConfigFields&)>;

struct TomlReading {
  std::vector<Error> problems;                 ///< each with file and line
  std::map<std::string, std::string> origins;  ///< "turntable.backlash_deg" -> "station.toml:7"
};

/// Sets what the TOML file names and leaves the rest at its default. Every problem is collected:
/// syntax, unknown key (with the nearest known one), wrong type, unknown word of a choice.
TomlReading read_toml(const std::filesystem::path& file, const ConfigWalk& walk);

/// The values in force as TOML; behind each key its meaning and where the value comes from.
std::string show_toml(const ConfigWalk& walk, const std::map<std::string, std::string>& origins);

/// The values in force as one flat JSON object: {"turntable.backlash_deg": {"value": 0.5,
/// "origin": "default"}, …}.
std::string show_json(const ConfigWalk& walk, const std::map<std::string, std::string>& origins);

}  // namespace skullstation
