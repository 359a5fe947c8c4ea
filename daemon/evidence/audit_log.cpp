#include "daemon/evidence/audit_log.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <optional>

#include "core/file.h"
#include "core/file_descriptor.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// The end of the log that is looked at to go on from: the last entry and what crashes left after.
constexpr std::uint64_t tail_bytes = 16 * max_audit_line;

struct LogEnd {
  std::optional<AuditEntry> last;
  std::string last_line;
  std::string torn;         ///< bytes after the last entry
  bool torn_ended = false;  ///< they end with torn_mark and a line feed already
};

tl::unexpected<Error> not_continued(const fs::path& file, std::string what) {
  return fail(ErrorKind::bad_input, file.string(), std::move(what),
              fmt::format("`skullstation audit verify {}` says what is wrong; keep this file and "
                          "begin another",
                          file.string()));
}

/// The last bytes of the file.
Result<std::string> read_tail(const FileDescriptor& file, const fs::path& path) {
  struct stat status {};
  if (::fstat(file.get(), &status) != 0) return read_error(path, errno);
  const auto size = static_cast<std::uint64_t>(status.st_size);
  std::string tail(std::min(size, tail_bytes), '\0');
  std::size_t filled = 0;
  while (filled < tail.size()) {
    const ssize_t got = ::pread(file.get(), tail.data() + filled, tail.size() - filled,
                                static_cast<off_t>(size - tail.size() + filled));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return read_error(path, got < 0 ? errno : EIO);
    filled += static_cast<std::size_t>(got);
  }
  return tail;
}

/// Takes the tail apart from its end: torn bytes, then the last entry.
LogEnd take_apart(std::string_view tail) {
  LogEnd end;
  std::string_view before = tail;  // what is not yet known to be torn
  end.torn_ended = true;
  if (!before.empty() && before.back() != '\n') {
    before = before.substr(0, before.rfind('\n') + 1);
    end.torn_ended = false;
  }
  while (!before.empty()) {
    const std::size_t begin = before.substr(0, before.size() - 1).rfind('\n') + 1;
    const std::string_view line = before.substr(begin, before.size() - 1 - begin);
    if (!line.ends_with(torn_mark)) {
      end.last_line = line;
      break;
    }
    before = before.substr(0, begin);
  }
  end.torn = tail.substr(before.size());
  return end;
}

Result<LogEnd> find_end(const FileDescriptor& file, const fs::path& path, const StationKeys& keys) {
  const auto tail = read_tail(file, path);
  if (!tail) return forward(tail);
  LogEnd end = take_apart(*tail);
  if (end.last_line.empty()) {
    if (end.torn.size() == tail->size() && tail->size() < tail_bytes) return end;
    return not_continued(path, "has no entry near its end");
  }
  auto last = parse_audit_entry(end.last_line, path.string() + ": last line");
  if (!last) return not_continued(path, "its last entry is damaged");
  if (!audit_signature_valid(end.last_line, keys.ed25519_public_pem)) {
    return not_continued(
        path, "its last entry was changed or signed with another key than this station's");
  }
  end.last = *std::move(last);
  return end;
}

/// The entry after `end` as a line; `end` becomes what it is with that line.
Result<std::string> next_line(LogEnd& end, AuditEntry entry, const StationKeys& keys) {
  entry.number = end.last ? end.last->number + 1 : 1;
  entry.previous = end.last ? sha256_hex(end.last_line) : std::string(64, '0');
  if (!end.torn.empty()) entry.torn = TornBytes{end.torn.size(), sha256_hex(end.torn)};
  auto line = format_audit_entry(entry, keys);
  if (!line) return line;
  end = {std::move(entry), *line, "", true};
  return line;
}

}  // namespace

Result<std::string> append_audit_entry(const AuditLogPlace& log, const AuditEvent& event,
                                       const StationKeys& keys, const Clock& clock) {
  const FileDescriptor file(
      ::open(log.file.c_str(), O_RDWR | O_APPEND | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0640));
  if (file.get() < 0) return write_error(log.file, errno);
  if (::flock(file.get(), LOCK_EX) != 0) return write_error(log.file, errno);
  auto end = find_end(file, log.file, keys);
  if (!end) return forward(end);

  std::string bytes;
  if (!end->torn.empty() && !end->torn_ended) {
    bytes = fmt::format("{}\n", torn_mark);
    end->torn += bytes;
  }
  AuditEntry entry;
  entry.time = to_iso8601(clock.utc_now());
  entry.station = log.station;
  const bool is_new = !end->last;
  if (is_new) {
    entry.who = "skullstation";
    entry.what = "log begun";
    entry.details = nlohmann::ordered_json{{"format", "skullstation-audit/1"},
                                           {"public_key", keys.ed25519_public_pem}}
                        .dump();
    auto first = next_line(*end, entry, keys);
    if (!first) return first;
    bytes += *first + "\n";
  }
  entry.who = event.who;
  entry.what = event.what;
  entry.subject = event.subject;
  entry.details = event.details;
  auto line = next_line(*end, entry, keys);
  if (!line) return line;
  bytes += *line + "\n";

  if (const int failure = write_all(file, bytes); failure != 0) {
    return write_error(log.file, failure);
  }
  if (::fsync(file.get()) != 0) return write_error(log.file, errno);
  const fs::path folder = fs::absolute(log.file).parent_path();
  if (is_new) {
    if (const auto synced = sync_folder(folder); !synced) return forward(synced);
  }
  return line;
}

}  // namespace skullstation
