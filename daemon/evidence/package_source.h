#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/session/session.h"

namespace skullstation {

/// What the user wants sealed.
struct PackageSource {
  std::filesystem::path case_folder;
  std::optional<std::filesystem::path> session;         ///< with its photographs
  std::optional<std::filesystem::path> reconstruction;  ///< what `reconstruct` left
  std::string case_number;  ///< empty: the session's, else the case folder's name
  std::string station;      ///< empty: the session's
  std::string program_version;
};

/// A file to be sealed and where it goes.
struct PayloadFile {
  std::filesystem::path source;
  std::string bag_path;  ///< "data/case/head.ply"
  std::uint64_t bytes = 0;
  /// What the session says that its sum is.
  std::optional<std::string> recorded_sha256;
};

/// The same, read and found sound.
// NOLINTNEXTLINE(bugprone-exception-escape): moving a JSON value throws nothing in fact
struct PackageContent {
  std::string case_number;
  std::string station;  ///< may be empty
  std::string program_version;
  nlohmann::ordered_json case_json;
  std::optional<Session> session;
  std::optional<nlohmann::ordered_json> reconstruction_quality;
  std::vector<PayloadFile> files;  ///< ascending by bag_path
  std::uint64_t bytes = 0;

  /// Case, session and reconstruction belong together: sums of `sealed` (by bag path) against those
  /// that case and session recorded.
  Result<void> check_links(const std::map<std::string, std::string>& sealed_sha256) const;
};

/// Reads the folders' JSON files and lists all their files. Fails for a folder that is not what it
/// should be, for symbolic links and names that a bag can't hold, and where the session is of
/// another case or the reconstruction of another session.
Result<PackageContent> read_package_source(const PackageSource& source);

/// The text at a JSON pointer ("/input/file"); empty if there is none.
std::string text_at(const nlohmann::ordered_json& json, const std::string& pointer);

}  // namespace skullstation
