#include "core/staged_folder.h"

#include <fmt/format.h>

#include <system_error>

#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

fs::path without_trailing_slash(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();
}

}  // namespace

StagedFolder::StagedFolder(const fs::path& place)
    : place_(without_trailing_slash(place)),
      staged_(place_.parent_path() / fmt::format(".{}.unfinished", place_.filename().string())) {
  std::error_code ignored;
  fs::remove_all(staged_, ignored);
}

StagedFolder::~StagedFolder() {
  std::error_code ignored;
  if (!done_) fs::remove_all(staged_, ignored);
}

Result<void> StagedFolder::make() const { return make_writable_folder(staged_); }

Result<void> StagedFolder::put_in_place() {
  std::error_code error;
  fs::rename(staged_, place_, error);
  if (error) return fail(ErrorKind::bad_input, place_.string(), error.message());
  done_ = true;
  return sync_folder(place_.parent_path());
}

Result<void> check_new_folder(const fs::path& folder) {
  std::error_code ignored;
  const bool is_there = fs::exists(folder, ignored);
  if (!is_there || (fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored))) return {};
  return fail(ErrorKind::usage, folder.string(), "is there already and is not empty",
              "name a new folder, or move this one away");
}

}  // namespace skullstation
