#include "tests/hardware_lab/kernel_file.h"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

namespace skullstation {
namespace {

class File {
 public:
  File(const std::filesystem::path& path, int flags)
      : path_(path), descriptor_(::open(path.c_str(), flags | O_CLOEXEC)) {
    check(descriptor_);
  }
  ~File() { ::close(descriptor_); }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  int descriptor() const { return descriptor_; }
  ssize_t check(ssize_t result) const {
    if (result < 0) throw std::system_error(errno, std::generic_category(), path_.string());
    return result;
  }

 private:
  std::filesystem::path path_;
  int descriptor_;
};

}  // namespace

void write_kernel_file(const std::filesystem::path& path, std::string_view text) {
  const File file(path, O_WRONLY);
  file.check(::write(file.descriptor(), text.data(), text.size()));
}

std::string read_kernel_file(const std::filesystem::path& path) {
  const File file(path, O_RDONLY);
  std::string text;
  std::array<char, 4096> part;
  while (const ssize_t length = file.check(::read(file.descriptor(), part.data(), part.size()))) {
    text.append(part.data(), static_cast<std::size_t>(length));
  }
  if (text.ends_with('\n')) text.pop_back();
  return text;
}

}  // namespace skullstation
