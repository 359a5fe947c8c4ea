#include "core/file_descriptor.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>

namespace skullstation {

namespace fs = std::filesystem;

namespace {

std::string reason(int error_number) { return std::system_category().message(error_number); }

}  // namespace

void FileDescriptor::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

int write_all(const FileDescriptor& file, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
  return 0;
}

tl::unexpected<Error> write_error(const fs::path& path, int error_number) {
  const std::string advice = error_number == ENOSPC ? "free some space on this volume"
                             : error_number == EACCES || error_number == EROFS
                                 ? "choose a folder that this user may write to"
                                 : "";
  return fail(ErrorKind::bad_input, path.string(),
              fmt::format("can't be written ({})", reason(error_number)), advice);
}

tl::unexpected<Error> read_error(const fs::path& path, int error_number) {
  return fail(ErrorKind::bad_input, path.string(),
              fmt::format("can't be read ({})", reason(error_number)));
}

}  // namespace skullstation
