#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// A file of an artifact: its name in the artifact's folder and the content it must have.
struct ArtifactFile {
  std::string path;  ///< "images/p0_c0_000.png"
  std::string sha256;
  std::uint64_t bytes = 0;
  bool operator==(const ArtifactFile&) const = default;
};

/// Files by their content: blobs/ab/abcd…, each read-only and never changed. Files come and go as
/// hard links, so nothing is copied and everything must lie on one file system.
class BlobStore {
 public:
  /// Makes the folder ready and removes what a crash left half done.
  static Result<BlobStore> open(const std::filesystem::path& folder);

  /// Takes every file below `folder` in; all are on the disk when it returns. The files stay where
  /// they are (read-only); taking the same files again is no harm. Errors (bad_input): links and
  /// other things that are not files, no space.
  Result<std::vector<ArtifactFile>> take(const std::filesystem::path& folder) const;

  /// Lays the files out in the new folder `to`, each checked against its hash on the way.
  Result<void> lay_out(const std::vector<ArtifactFile>& files,
                       const std::filesystem::path& to) const;

  std::filesystem::path path_of(const std::string& sha256) const;

  /// Is it there, with the right size and, if `thorough`, the right content?
  Result<void> check(const ArtifactFile& file, bool thorough) const;

  /// Removes every blob that `wanted` does not name; returns how many those were.
  Result<int> remove_all_but(const std::set<std::string>& wanted) const;

 private:
  explicit BlobStore(std::filesystem::path folder) : folder_(std::move(folder)) {}
  Result<ArtifactFile> take_file(const std::filesystem::path& file, const std::string& name) const;

  std::filesystem::path folder_;
};

}  // namespace skullstation
