#include "capture/scan/space_reserve.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <system_error>
#include <utility>

#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

Result<SpaceReserve> SpaceReserve::take(const fs::path& folder, std::uint64_t bytes) {
  const fs::path file = folder / file_name;
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
  if (descriptor < 0) {
    return fail(ErrorKind::bad_input, file.string(),
                fmt::format("can't be written ({})", std::system_category().message(errno)));
  }
  SpaceReserve reserve(file, descriptor, bytes);
  // From nothing, so that a reserve left by a crash counts as free space.
  if (::ftruncate(descriptor, 0) != 0) {
    return fail(ErrorKind::bad_input, file.string(),
                fmt::format("can't be written ({})", std::system_category().message(errno)));
  }
  // posix_fallocate writes the blocks itself where the file system has no other way.
  const int failure = bytes == 0 ? 0 : ::posix_fallocate(descriptor, 0, static_cast<off_t>(bytes));
  if (failure != 0) {
    constexpr double mib = 1024.0 * 1024.0;
    const Result<std::uint64_t> free = free_space_bytes(folder);
    return fail(ErrorKind::bad_input, folder.string(),
                fmt::format("has no room for the scan: {:.0f} MiB are needed, {} free ({})",
                            static_cast<double>(bytes) / mib,
                            free ? fmt::format("{:.0f} MiB are", static_cast<double>(*free) / mib)
                                 : "an unknown amount is",
                            std::system_category().message(failure)),
                "free some space on this volume or choose a folder on another one");
  }
  return reserve;
}

SpaceReserve::SpaceReserve(SpaceReserve&& other) noexcept
    : file_(std::move(other.file_)),
      descriptor_(std::exchange(other.descriptor_, -1)),
      bytes_(other.bytes_) {}

SpaceReserve::~SpaceReserve() {
  if (descriptor_ < 0) return;
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

void SpaceReserve::shrink_to(std::uint64_t bytes) {
  // A failure leaves more reserved than needed: the write that follows tells whether it matters.
  if (bytes < bytes_ && ::ftruncate(descriptor_, static_cast<off_t>(bytes)) == 0) bytes_ = bytes;
}

}  // namespace skullstation
