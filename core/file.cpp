#include "core/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <sstream>
#include <system_error>
#include <vector>

#include "core/file_descriptor.h"
#include "core/sha256.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// 0, or the errno of the step that failed.
int write_and_sync(const fs::path& path, std::string_view bytes) {
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file.get() < 0) return errno;
  if (const int failure = write_all(file, bytes); failure != 0) return failure;
  return ::fsync(file.get()) == 0 ? 0 : errno;
}

int folder_sync_failure(const fs::path& folder) {
  const FileDescriptor handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (handle.get() < 0) return errno;
  return ::fsync(handle.get()) == 0 ? 0 : errno;
}

}  // namespace

Result<std::string> read_file(const fs::path& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored)) {
    return fail(ErrorKind::bad_input, path.string(), "is a folder; a file was expected");
  }
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return read_error(path, errno);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (in.bad()) return fail(ErrorKind::bad_input, path.string(), "reading stopped midway");
  return std::move(bytes).str();
}

Result<void> write_file_durably(const fs::path& path, std::string_view bytes) {
  const fs::path folder = path.has_parent_path() ? path.parent_path() : fs::path(".");
  const fs::path temporary = path.string() + ".part";
  int failure = write_and_sync(temporary, bytes);
  if (failure == 0 && ::rename(temporary.c_str(), path.c_str()) != 0) failure = errno;
  if (failure == 0) failure = folder_sync_failure(folder);
  if (failure != 0) {
    ::unlink(temporary.c_str());
    return write_error(path, failure);
  }
  return {};
}

Result<void> make_writable_folder(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) return write_error(folder, error.value());
  if (!fs::is_directory(folder)) {
    return fail(ErrorKind::bad_input, folder.string(), "is a file; a folder was expected");
  }
  if (::access(folder.c_str(), W_OK | X_OK) != 0) return write_error(folder, errno);
  return {};
}

Result<std::uint64_t> free_space_bytes(const fs::path& folder) {
  std::error_code error;
  const fs::space_info space = fs::space(folder, error);
  if (error) {
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("its free space is unknown ({})", error.message()));
  }
  return space.available;
}

Result<void> sync_folder(const fs::path& folder) {
  if (const int failure = folder_sync_failure(folder); failure != 0) {
    return write_error(folder, failure);
  }
  return {};
}

std::string sha256_hex(std::string_view bytes) {
  Sha256 sum;
  sum.update(bytes);
  return sum.finish();
}

Result<std::string> sha256_of_file(const fs::path& path) {
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return read_error(path, errno);
  Sha256 sum;
  std::vector<char> buffer(std::size_t{1} << 18);
  for (;;) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return read_error(path, errno);
    if (count == 0) break;
    sum.update({buffer.data(), static_cast<std::size_t>(count)});
  }
  return sum.finish();
}

}  // namespace skullstation
