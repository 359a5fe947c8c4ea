#pragma once

#include <filesystem>
#include <string_view>

#include "core/result.h"

namespace skullstation {

/// Closes what it holds at the end of the scope; negative: nothing.
class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() { close(); }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }
  void close();

 private:
  int fd_;
};

/// Writes all of it, however often the kernel takes only a part. Returns 0 or an errno.
int write_all(const FileDescriptor& file, std::string_view bytes);

/// What to tell a user when writing `path` failed with `error_number`.
tl::unexpected<Error> write_error(const std::filesystem::path& path, int error_number);

/// What to tell a user when reading `path` failed with `error_number`.
tl::unexpected<Error> read_error(const std::filesystem::path& path, int error_number);

}  // namespace skullstation
