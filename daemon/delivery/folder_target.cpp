// A folder, also one that is mounted from elsewhere (SMB, NFS). A file appears whole or not at all:
// temporary name, fsync, rename, fsync of the folder.

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <system_error>

#include "core/file.h"
#include "core/file_descriptor.h"
#include "core/sha256.h"
#include "daemon/delivery/target.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t piece_bytes = 1 << 20;

/// Most of what a share says is over by tomorrow; what is not has to do with rights.
tl::unexpected<Error> share_error(const fs::path& path, int number) {
  const bool rights = number == EACCES || number == EPERM;
  const std::string reason = std::system_category().message(number);
  return fail(rights ? ErrorKind::bad_input : ErrorKind::hardware, path.string(),
              number == ENOSPC || number == EDQUOT ? "the receiver's disk is full"
                                                   : fmt::format("can't be used ({})", reason),
              rights             ? "give this program's user the right to write there, then retry"
              : number == ENOSPC ? "free some space there; it is tried again"
                                 : "see whether the share is mounted and its server runs");
}

class FolderTarget final : public Target {
 public:
  FolderTarget(fs::path folder, bool mounted) : folder_(std::move(folder)), mounted_(mounted) {}

  Result<void> put(const DeliveryObject& object, const Progress& progress) override {
    if (auto there = check_folder(); !there) return there;
    const fs::path place = folder_ / object.name;
    const fs::path temporary = place.parent_path() / ("." + place.filename().string() + ".part");
    if (auto made = make_folders(place.parent_path()); !made) return made;
    if (auto copied = copy(object.file, temporary, progress); !copied) {
      ::unlink(temporary.c_str());
      return copied;
    }
    // A share may not know RENAME_NOREPLACE; nobody but us writes names like these.
    if (::access(place.c_str(), F_OK) == 0) {
      ::unlink(temporary.c_str());
      return {};
    }
    if (::rename(temporary.c_str(), place.c_str()) != 0) return share_error(place, errno);
    return sync(place.parent_path());
  }

  Result<std::optional<std::string>> read_back(const DeliveryObject& object,
                                               const Progress& progress) override {
    if (auto there = check_folder(); !there) return forward(there);
    const fs::path place = folder_ / object.name;
    const FileDescriptor file(::open(place.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW));
    if (file.get() < 0) {
      if (errno == ENOENT) return std::optional<std::string>();
      return share_error(place, errno);
    }
    // What is read must come from there, as far as that can be had, not from this machine's cache.
    ::posix_fadvise(file.get(), 0, 0, POSIX_FADV_DONTNEED);
    Sha256 sum;
    auto read = each_piece(file, place, progress, [&](std::string_view piece) {
      sum.update(piece);
      return Result<void>();
    });
    if (!read) return forward(read);
    return std::optional(sum.finish());
  }

  Result<bool> remove(const DeliveryObject& object) override {
    const fs::path place = folder_ / object.name;
    if (::unlink(place.c_str()) != 0) return share_error(place, errno);
    return true;
  }

 private:
  Result<void> check_folder() const {
    struct stat folder {};
    struct stat root {};
    if (::stat(folder_.c_str(), &folder) != 0) return share_error(folder_, errno);
    if (!S_ISDIR(folder.st_mode)) {
      return fail(ErrorKind::bad_input, folder_.string(), "is no folder");
    }
    if (mounted_ && ::stat("/", &root) == 0 && root.st_dev == folder.st_dev) {
      return fail(ErrorKind::hardware, folder_.string(),
                  "nothing is mounted there: it lies on this machine's own disk",
                  "mount the share; it is tried again");
    }
    return {};
  }

  Result<void> make_folders(const fs::path& folder) const {
    if (folder == folder_ || !folder.has_relative_path()) return {};
    if (auto parent = make_folders(folder.parent_path()); !parent) return parent;
    if (::mkdir(folder.c_str(), 0777) == 0) return sync(folder.parent_path());
    if (errno != EEXIST) return share_error(folder, errno);
    return {};
  }

  static Result<void> sync(const fs::path& folder) {
    const FileDescriptor handle(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    // Some shares (SMB) can't sync a folder and say so: EINVAL.
    if (handle.get() < 0 || (::fsync(handle.get()) != 0 && errno != EINVAL)) {
      return share_error(folder, errno);
    }
    return {};
  }

  template <class Use>
  static Result<void> each_piece(const FileDescriptor& file, const fs::path& name,
                                 const Progress& progress, const Use& use) {
    std::string piece(piece_bytes, '\0');
    for (;;) {
      if (progress.stop.stop_requested()) {
        return fail(ErrorKind::cancelled, name.string(), "delivery was stopped on request");
      }
      const ssize_t count = ::read(file.get(), piece.data(), piece.size());
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) return share_error(name, errno);
      if (count == 0) return {};
      auto used = use(std::string_view(piece.data(), static_cast<std::size_t>(count)));
      if (!used) return used;
    }
  }

  static Result<void> copy(const fs::path& from, const fs::path& to, const Progress& progress) {
    const FileDescriptor in(::open(from.c_str(), O_RDONLY | O_CLOEXEC));
    if (in.get() < 0) return read_error(from, errno);
    const FileDescriptor out(::open(to.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666));
    if (out.get() < 0) return share_error(to, errno);
    auto copied = each_piece(in, from, progress, [&](std::string_view piece) -> Result<void> {
      if (const int failure = write_all(out, piece); failure != 0) return share_error(to, failure);
      return {};
    });
    if (!copied) return copied;
    if (::fsync(out.get()) != 0) return share_error(to, errno);
    return {};
  }

  fs::path folder_;
  bool mounted_;
};

}  // namespace

Result<std::unique_ptr<Target>> open_folder_target(const TargetConfig& config) {
  fs::path folder = fs::path(config.address).lexically_normal();
  if (folder.filename().empty()) folder = folder.parent_path();
  return std::make_unique<FolderTarget>(folder, config.mounted);
}

}  // namespace skullstation
