#include "daemon/evidence/sealed_copy.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <memory>
#include <string_view>

#include "core/file.h"
#include "core/file_descriptor.h"
#include "core/parallel.h"
#include "core/sha256.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// Read, hashed and written at a time: whole blocks.
constexpr std::size_t chunk_bytes = 16 * block_bytes;
/// Below it, threads cost more than they save.
constexpr std::uint64_t parallel_from_bytes = std::uint64_t{1024} * 1024;

/// A piece of a file. Its buffer is not cleared first: a small file would pay for a large one's.
struct Chunk {
  std::unique_ptr<char[]> buffer;
  std::size_t capacity = 0;
  std::size_t filled = 0;

  explicit Chunk(std::size_t size) : buffer(new char[size]), capacity(size) {}
  std::string_view bytes() const { return {buffer.get(), filled}; }
};

/// Fills the buffer as far as the file goes; 0 or an errno.
int read_chunk(const FileDescriptor& file, Chunk& chunk) {
  chunk.filled = 0;
  while (chunk.filled < chunk.capacity) {
    const ssize_t got =
        ::read(file.get(), chunk.buffer.get() + chunk.filled, chunk.capacity - chunk.filled);
    if (got < 0 && errno == EINTR) continue;
    if (got < 0) return errno;
    if (got == 0) break;
    chunk.filled += static_cast<std::size_t>(got);
  }
  return 0;
}

void add_blocks(std::string_view chunk, std::vector<std::string>& sums) {
  for (; !chunk.empty(); chunk.remove_prefix(std::min<std::size_t>(block_bytes, chunk.size()))) {
    sums.push_back(sha256_hex(chunk.substr(0, block_bytes)));
  }
}

FileDescriptor open_to_read(const fs::path& path) {
  return FileDescriptor(::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
}

tl::unexpected<Error> cancelled(const fs::path& path) {
  return fail(ErrorKind::cancelled, path.string(), "was not read to its end");
}

/// Reads the file chunk by chunk. While one is hashed, `write(chunk)` stores it (0 or an errno) and
/// the next is read.
template <class Write>
Result<FileDigest> digest(const fs::path& from, const fs::path& to, int threads, bool with_blocks,
                          const std::stop_token& stop, const BytesDone& done, const Write& write) {
  const FileDescriptor in = open_to_read(from);
  if (in.get() < 0) return read_error(from, errno);
  struct stat status {};
  if (::fstat(in.get(), &status) != 0) return read_error(from, errno);
  if (!S_ISREG(status.st_mode)) {
    return fail(ErrorKind::bad_input, from.string(), "is no ordinary file");
  }
  ::posix_fadvise(in.get(), 0, 0, POSIX_FADV_SEQUENTIAL);
  const auto expected = static_cast<std::uint64_t>(status.st_size);
  if (expected < parallel_from_bytes) threads = 1;
  FileDigest found;
  Sha256 whole;
  const auto capacity = static_cast<std::size_t>(
      std::clamp<std::uint64_t>(expected, block_bytes, chunk_bytes) / block_bytes * block_bytes);
  std::array<Chunk, 2> chunks = {Chunk(capacity), Chunk(capacity)};
  int read_failure = read_chunk(in, chunks[0]);
  for (int current = 0; read_failure == 0; current = 1 - current) {
    const std::string_view chunk = chunks[static_cast<std::size_t>(current)].bytes();
    if (chunk.empty()) break;
    if (stop.stop_requested()) return cancelled(from);
    int write_failure = 0;
    parallel_for(3, threads, [&](int job) {
      if (job == 0) {
        write_failure = write(chunk);
        read_failure = read_chunk(in, chunks[static_cast<std::size_t>(1 - current)]);
      } else if (job == 1) {
        whole.update(chunk);
      } else if (with_blocks) {
        add_blocks(chunk, found.block_sha256);
      }
    });
    if (write_failure != 0) return write_error(to, write_failure);
    found.bytes += chunk.size();
    done(chunk.size());
  }
  if (read_failure != 0) return read_error(from, read_failure);
  if (found.bytes != expected) {
    return fail(ErrorKind::bad_input, from.string(), "changed while it was read",
                "wait until whoever writes to it is done");
  }
  found.sha256 = whole.finish();
  return found;
}

}  // namespace

Result<FileDigest> copy_sealed(const fs::path& from, const fs::path& to, int threads,
                               const std::stop_token& stop, const BytesDone& done) {
  const FileDescriptor out(::open(to.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0644));
  if (out.get() < 0) return write_error(to, errno);
  auto copied = digest(from, to, threads, true, stop, done,
                       [&](std::string_view chunk) { return write_all(out, chunk); });
  if (copied && ::fsync(out.get()) != 0) return write_error(to, errno);
  return copied;
}

Result<FileDigest> digest_file(const fs::path& path, bool with_blocks, const std::stop_token& stop,
                               const BytesDone& done) {
  return digest(path, path, with_blocks ? 2 : 1, with_blocks, stop, done,
                [](std::string_view) { return 0; });
}

}  // namespace skullstation
