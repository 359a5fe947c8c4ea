#include "daemon/evidence/audit_check.h"

#include <fmt/format.h>

#include <fstream>

#include "core/file.h"
#include "core/file_descriptor.h"
#include "core/sha256.h"
#include "daemon/evidence/audit_log.h"
#include "daemon/evidence/signature.h"

namespace skullstation {

namespace {

/// More are not told one by one.
constexpr std::size_t max_findings = 1000;

/// A line of the file with its place.
struct Line {
  std::uint64_t number = 0;
  std::uint64_t begin = 0, end = 0;  ///< with its line feed
  std::string text;
  bool ended = false;  ///< by a line feed
};

/// Lines one by one; one beyond twice the longest entry is handed out in pieces that are no
/// entries.
bool next(std::istream& in, Line& line) {
  ++line.number;
  line.begin = line.end;
  line.text.clear();
  line.ended = false;
  for (int c = in.get(); c != std::istream::traits_type::eof(); c = in.get()) {
    ++line.end;
    line.ended = c == '\n';
    if (line.ended) return true;
    line.text += static_cast<char>(c);
    if (line.text.size() > 2 * max_audit_line) return true;
  }
  return !line.text.empty();
}

class LogReader {
 public:
  LogReader(const std::optional<Trust>& trust, const std::vector<AuditHead>& heads)
      : trust_(trust), heads_(heads), head_seen_(heads.size(), false) {}

  void take(const Line& line) {
    if (line.ended && line.text.ends_with(torn_mark)) return take_torn(line);
    auto entry = parse_audit_entry(line.text, "");
    if (!line.ended) {
      find(line, "is not complete: the station stopped while it was written, or it was cut since");
    } else if (!entry) {
      find(line, "is no entry of this log: changed or put in");
      expected_ += 1;
      previous_ = std::nullopt;
    } else {
      take_entry(line, *entry);
    }
  }

  AuditCheck finish() {
    if (torn_.bytes > 0) {
      find(torn_line_, "is torn, and no entry after it says so: entries after it were removed");
    }
    if (check_.entries == 0) find({}, "the log holds no entry");
    for (std::size_t i = 0; i < heads_.size(); ++i) {
      if (!head_seen_[i]) missing_head(heads_[i]);
    }
    return std::move(check_);
  }

 private:
  void find(const Line& line, std::string what) {
    if (check_.findings.size() == max_findings) what = "and more after it";
    if (check_.findings.size() > max_findings) return;
    check_.findings.push_back({line.number, line.begin, line.end, std::move(what)});
  }

  void take_torn(const Line& line) {
    if (torn_.bytes == 0) {
      torn_line_ = line;
      torn_line_.text.clear();
    }
    torn_sum_.update(line.text);
    torn_sum_.update("\n");
    torn_.bytes += line.end - line.begin;
    torn_line_.end = line.end;
  }

  void take_entry(const Line& line, const AuditEntry& entry) {
    if (check_.entries == 0) choose_key(line, entry);
    const bool sound = audit_signature_valid(line.text, key_pem_);
    if (!sound) {
      find(line, fmt::format("entry {} was changed: its signature is not the key's", entry.number));
    } else if (entry.number > expected_) {
      find(line, entry.number == expected_ + 1
                     ? fmt::format("entry {} is missing before it", expected_)
                     : fmt::format("entries {} to {} are missing before it", expected_,
                                   entry.number - 1));
    } else if (entry.number < expected_) {
      find(line, fmt::format("entry {} is out of order or there twice", entry.number));
    } else if (previous_ && *previous_ != entry.previous) {
      find(line, fmt::format("entry {} does not follow the line before it", entry.number));
    }
    check_torn(line, entry);
    if (sound && entry.time < check_.last_time) {
      check_.notes.push_back({line.number, line.begin, line.end,
                              fmt::format("the station's clock went back, from {} to {}",
                                          check_.last_time, entry.time)});
    }
    check_.entries += 1;
    check_.head_sha256 = sha256_hex(line.text);
    // What a changed entry says of itself is not built upon.
    expected_ = sound ? entry.number + 1 : expected_ + 1;
    previous_ = sound ? std::optional(check_.head_sha256) : std::nullopt;
    if (sound) {
      check_.last_time = entry.time;
      check_.station = entry.station;
    }
    for (std::size_t i = 0; i < heads_.size(); ++i) {
      if (heads_[i].line == line.text) head_seen_[i] = true;
    }
  }

  /// The key that signatures are checked with: the one that the first entry names.
  void choose_key(const Line& line, const AuditEntry& first) {
    const auto named = public_key_of(first);
    if (named) key_pem_ = *named;
    if (!named) find(line, "is not a log's first entry: it names no public key");
    if (!named && trust_) use_trusted_key(line);
    check_.key_fingerprint = public_key_fingerprint(key_pem_);
    if (!trust_) return;
    check_.key_trusted = trusts_key(*trust_, key_pem_);
    if (!*check_.key_trusted) {
      find(line,
           fmt::format("the log's key ({}) is not among the trusted keys", check_.key_fingerprint));
    }
  }

  /// With its beginning lost, the rest can still be checked with a trusted key that fits.
  void use_trusted_key(const Line& line) {
    for (const std::string& pem : trust_->public_keys_pem) {
      if (audit_signature_valid(line.text, pem)) key_pem_ = pem;
    }
  }

  void check_torn(const Line& line, const AuditEntry& entry) {
    TornBytes found = std::move(torn_);
    if (found.bytes > 0) found.sha256 = torn_sum_.finish();
    torn_ = {};
    if (entry.torn.value_or(TornBytes{}) != found) {
      find(line,
           fmt::format("torn bytes before entry {} were changed, removed or put in", entry.number));
    } else if (entry.torn) {
      check_.notes.push_back(
          {torn_line_.number, torn_line_.begin, torn_line_.end,
           fmt::format("an entry was torn by a crash; entry {} recorded it", entry.number)});
    }
  }

  void missing_head(const AuditHead& head) {
    const auto entry = parse_audit_entry(head.line, head.origin);
    if (!entry) {
      check_.findings.push_back({0, 0, 0, head.origin + " holds no entry of an audit log"});
    } else if (entry->number >= expected_) {
      check_.findings.push_back(
          {0, 0, 0,
           fmt::format("the log ends with entry {}, and {} carries entry {}: its end was removed",
                       expected_ - 1, head.origin, entry->number)});
    } else {
      check_.findings.push_back(
          {0, 0, 0,
           fmt::format("entry {} of this log is not the one that {} carries: the log was written "
                       "anew, or they are of different stations",
                       entry->number, head.origin)});
    }
  }

  const std::optional<Trust>& trust_;
  const std::vector<AuditHead>& heads_;
  std::vector<bool> head_seen_;
  AuditCheck check_;
  std::string key_pem_;
  std::uint64_t expected_ = 1;
  std::optional<std::string> previous_ = std::string(64, '0');  ///< unknown after a lost line
  TornBytes torn_;
  Line torn_line_;
  Sha256 torn_sum_;
};

}  // namespace

AuditCheck check_audit_log(std::istream& log, const std::optional<Trust>& trust,
                           const std::vector<AuditHead>& heads) {
  LogReader reader(trust, heads);
  for (Line line; next(log, line);) reader.take(line);
  return reader.finish();
}

Result<AuditCheck> check_audit_file(const std::filesystem::path& file,
                                    const std::optional<Trust>& trust,
                                    const std::vector<AuditHead>& heads) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored)) {
    return fail(ErrorKind::bad_input, file.string(), "is a folder; a file was expected");
  }
  errno = 0;
  std::ifstream in(file, std::ios::binary);
  if (!in) return read_error(file, errno);
  AuditCheck check = check_audit_log(in, trust, heads);
  if (in.bad()) return fail(ErrorKind::bad_input, file.string(), "reading stopped midway");
  return check;
}

}  // namespace skullstation
