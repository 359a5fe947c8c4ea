#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>

namespace skullstation::testing {

/// What a running station says to one line at its control socket (docs/station.md). Discarded JSON
/// if nobody answers.
nlohmann::json ask_station(const std::filesystem::path& socket, const std::string& line);

/// Polls until it holds; false after the time.
bool comes_true(const std::function<bool()>& condition,
                std::chrono::seconds time = std::chrono::seconds(60));

}  // namespace skullstation::testing
