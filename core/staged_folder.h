#pragma once

#include <filesystem>

#include "core/result.h"

namespace skullstation {

/// A folder that appears whole or not at all: it is filled under another name beside its place and
/// then renamed; removed unless that was done.
class StagedFolder {
 public:
  explicit StagedFolder(const std::filesystem::path& place);
  ~StagedFolder();
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  std::filesystem::path operator/(const std::filesystem::path& name) const {
    return staged_ / name;
  }
  const std::filesystem::path& path() const { return staged_; }
  Result<void> make() const;
  Result<void> put_in_place();

 private:
  std::filesystem::path place_;
  std::filesystem::path staged_;
  bool done_ = false;
};

/// Fails with `usage` where the folder is there already and holds something.
Result<void> check_new_folder(const std::filesystem::path& folder);

}  // namespace skullstation
