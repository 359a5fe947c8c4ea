#include "core/file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <openssl/evp.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <fstream>
#include <memory>
#include <sstream>
#include <system_error>
#include <vector>

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using Digest = std::array<unsigned char, EVP_MAX_MD_SIZE>;

std::string hex_of(const Digest& digest, unsigned int size) {
  std::string hex;
  for (unsigned int i = 0; i < size; ++i) hex += fmt::format("{:02x}", digest[i]);
  return hex;
}

std::string reason(int error_number) { return std::system_category().message(error_number); }

tl::unexpected<Error> write_error(const fs::path& path, int error_number) {
  const std::string advice = error_number == ENOSPC ? "free some space on this volume"
                             : error_number == EACCES || error_number == EROFS
                                 ? "choose a folder that this user may write to"
                                 : "";
  return fail(ErrorKind::bad_input, path.string(),
              fmt::format("can't be written ({})", reason(error_number)), advice);
}

class FileDescriptor {
 public:
  explicit FileDescriptor(int fd) : fd_(fd) {}
  ~FileDescriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  FileDescriptor(const FileDescriptor&) = delete;
  FileDescriptor& operator=(const FileDescriptor&) = delete;
  int get() const { return fd_; }

 private:
  int fd_;
};

/// 0, or the errno of the step that failed.
int write_and_sync(const fs::path& path, std::string_view bytes) {
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0644));
  if (file.get() < 0) return errno;
  while (!bytes.empty()) {
    const ssize_t written = ::write(file.get(), bytes.data(), bytes.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) return errno;
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
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
  if (!in) {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("can't be read ({})", reason(errno)));
  }
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
  Digest digest{};
  unsigned int size = 0;
  EVP_Digest(bytes.data(), bytes.size(), digest.data(), &size, EVP_sha256(), nullptr);
  return hex_of(digest, size);
}

Result<std::string> sha256_of_file(const fs::path& path) {
  const auto unreadable = [&] {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("can't be read ({})", reason(errno)));
  };
  const FileDescriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  if (file.get() < 0) return unreadable();
  const std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context(EVP_MD_CTX_new(),
                                                                        &EVP_MD_CTX_free);
  EVP_DigestInit_ex(context.get(), EVP_sha256(), nullptr);
  std::vector<char> buffer(std::size_t{1} << 18);
  for (;;) {
    const ssize_t count = ::read(file.get(), buffer.data(), buffer.size());
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) return unreadable();
    if (count == 0) break;
    EVP_DigestUpdate(context.get(), buffer.data(), static_cast<std::size_t>(count));
  }
  Digest digest{};
  unsigned int size = 0;
  EVP_DigestFinal_ex(context.get(), digest.data(), &size);
  return hex_of(digest, size);
}

}  // namespace skullstation
