#include "daemon/jobs/blob_store.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "core/file.h"
#include "core/file_descriptor.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t most_files = 100'000;  // of one artifact; a scan has a few hundred
constexpr std::size_t hash_length = 64;

tl::unexpected<Error> failed(const fs::path& path, const char* what, int error_number) {
  return fail(ErrorKind::bad_input, path.string(),
              fmt::format("{} ({})", what, std::system_category().message(error_number)),
              error_number == ENOSPC ? "free some space on this volume" : "");
}

/// On the disk, and nobody writes to it any more.
Result<void> seal(const fs::path& file) {
  const FileDescriptor opened(::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC));
  if (opened.get() < 0) return failed(file, "can't be opened", errno);
  if (::fchmod(opened.get(), 0444) != 0 || ::fsync(opened.get()) != 0) {
    return failed(file, "can't be made safe", errno);
  }
  return {};
}

}  // namespace

Result<BlobStore> BlobStore::open(const fs::path& folder) {
  BlobStore store(folder);
  for (int first = 0; first < 256; ++first) {
    const fs::path shelf = folder / fmt::format("{:02x}", first);
    std::error_code error;
    if (fs::create_directories(shelf, error); error) {
      return failed(shelf, "can't be made", error.value());
    }
    for (const auto& entry : fs::directory_iterator(shelf, error)) {
      if (entry.path().extension() == ".part") fs::remove(entry.path(), error);
    }
  }
  if (auto synced = sync_folder(folder); !synced) return forward(synced);
  return store;
}

fs::path BlobStore::path_of(const std::string& sha256) const {
  return folder_ / sha256.substr(0, 2) / sha256;
}

Result<ArtifactFile> BlobStore::take_file(const fs::path& file, const std::string& name) const {
  if (auto sealed = seal(file); !sealed) return forward(sealed);
  auto hash = sha256_of_file(file);
  if (!hash) return forward(hash);
  std::error_code error;
  const ArtifactFile taken{name, *hash, fs::file_size(file, error)};
  const fs::path blob = path_of(*hash);
  if (::link(file.c_str(), blob.c_str()) != 0) {
    if (errno != EEXIST) return failed(blob, "can't be written", errno);
    if (check(taken, true)) return taken;
    // The blob that is there has rotted: this is a sound copy of it.
    const fs::path part = blob.string() + ".part";
    if (::link(file.c_str(), part.c_str()) != 0 || ::rename(part.c_str(), blob.c_str()) != 0) {
      return failed(blob, "can't be mended", errno);
    }
  }
  return taken;
}

Result<std::vector<ArtifactFile>> BlobStore::take(const fs::path& folder) const {
  std::vector<fs::path> found;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const fs::file_status status = entry->symlink_status();
    if (fs::is_directory(status)) continue;
    if (!fs::is_regular_file(status)) {
      return fail(ErrorKind::bad_input, entry->path().string(),
                  "is a link or a device; files were expected");
    }
    found.push_back(entry->path());
    if (found.size() > most_files) {
      return fail(ErrorKind::bad_input, folder.string(),
                  fmt::format("holds more than {} files", most_files));
    }
  }
  if (error) return failed(folder, "can't be read", error.value());
  std::ranges::sort(found);
  std::vector<ArtifactFile> taken;
  std::set<fs::path> shelves;
  for (const fs::path& file : found) {
    auto entry = take_file(file, file.lexically_relative(folder).generic_string());
    if (!entry) return forward(entry);
    shelves.insert(path_of(entry->sha256).parent_path());
    taken.push_back(*std::move(entry));
  }
  for (const fs::path& shelf : shelves) {
    if (auto synced = sync_folder(shelf); !synced) return forward(synced);
  }
  return taken;
}

Result<void> BlobStore::check(const ArtifactFile& file, bool thorough) const {
  const fs::path blob = path_of(file.sha256);
  std::error_code error;
  const std::uint64_t bytes = fs::file_size(blob, error);
  if (error) return fail(ErrorKind::bad_input, blob.string(), "is missing: " + file.path);
  bool sound = bytes == file.bytes;
  if (sound && thorough) {
    const auto hash = sha256_of_file(blob);
    if (!hash) return forward(hash);
    sound = *hash == file.sha256;
  }
  if (!sound) return fail(ErrorKind::bad_input, blob.string(), "is damaged: " + file.path);
  return {};
}

Result<void> BlobStore::lay_out(const std::vector<ArtifactFile>& files, const fs::path& to) const {
  std::error_code error;
  fs::create_directories(to, error);
  if (error) return failed(to, "can't be made", error.value());
  for (const ArtifactFile& file : files) {
    if (auto sound = check(file, true); !sound) return sound;
    const fs::path place = to / file.path;
    fs::create_directories(place.parent_path(), error);
    if (error) return failed(place.parent_path(), "can't be made", error.value());
    if (::link(path_of(file.sha256).c_str(), place.c_str()) != 0) {
      return failed(place, "can't be written", errno);
    }
  }
  return {};
}

Result<int> BlobStore::remove_all_but(const std::set<std::string>& wanted) const {
  int removed = 0;
  std::error_code error;
  for (auto entry = fs::recursive_directory_iterator(folder_, error);
       !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    if (entry->is_directory() || wanted.contains(name)) continue;
    if (name.size() != hash_length) continue;  // not ours
    if (::unlink(entry->path().c_str()) != 0) {
      return failed(entry->path(), "can't be removed", errno);
    }
    ++removed;
  }
  if (error) return failed(folder_, "can't be read", error.value());
  return removed;
}

}  // namespace skullstation
