#pragma once

#include <filesystem>

namespace skullstation::testing {

/// Where a temporary folder lies: in memory what is tested makes thousands of files safe at no
/// cost.
enum class Medium { disk, memory };

/// A fresh folder that is removed, with what is in it, at the end of the scope.
class TemporaryFolder {
 public:
  explicit TemporaryFolder(Medium medium = Medium::disk);
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
