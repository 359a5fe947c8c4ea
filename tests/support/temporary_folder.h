#pragma once

#include <filesystem>

namespace skullstation::testing {

/// A fresh folder that is removed, with what is in it, at the end of the scope.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;

  const std::filesystem::path& path() const { return path_; }
  std::filesystem::path operator/(const std::filesystem::path& name) const { return path_ / name; }

 private:
  std::filesystem::path path_;
};

/// The folder of real data beside the project (../shared/data); tests skip where it is absent.
std::filesystem::path real_data_folder();

}  // namespace skullstation::testing
