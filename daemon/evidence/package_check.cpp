#include "daemon/evidence/package_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/evidence/bag_manifest.h"
#include "daemon/evidence/package.h"
#include "daemon/evidence/sealed_copy.h"
#include "daemon/evidence/signature.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

using Sums = std::map<std::string, std::string>;

/// The most bytes that a tag file may have: blocks-sha256.txt of 4 TB.
constexpr std::uint64_t max_tag_bytes = 1024ULL * 1024 * 1024;

bool is_payload(std::string_view path) { return path.starts_with("data/"); }

class PackageReader {
 public:
  PackageReader(fs::path folder, const std::optional<Trust>& trust, const Progress& progress)
      : folder_(std::move(folder)), trust_(trust), progress_(progress) {}

  Result<PackageCheck> check() {
    if (const auto listed = list_files(); !listed) return forward(listed);
    if (!there_.contains(bagit_file)) {
      return fail(ErrorKind::bad_input, folder_.string(), "holds no bagit.txt: it is no package");
    }
    tag_manifest_ = tag_text(tag_manifest_file);
    const auto tags = manifest(tag_manifest_file);
    if (tags) check_tag_files(*tags);
    check_signature_sums();
    check_signatures();
    check_time_stamp();
    check_audit_entry();
    const auto payload = manifest(manifest_file);
    if (const auto read = check_payload(payload.value_or(Sums{})); !read) return forward(read);
    find_strangers(tags, payload);
    read_names();
    return std::move(check_);
  }

 private:
  void find(PackageFault fault, const std::string& file, std::string what,
            std::vector<ByteRange> ranges = {}) {
    check_.findings.push_back({fault, file, std::move(ranges), std::move(what)});
  }

  /// All files of the bag with their sizes; links and other special files are findings.
  Result<void> list_files() {
    std::error_code error;
    fs::recursive_directory_iterator entry(folder_, error);
    for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error)) {
      const std::string path = entry->path().lexically_relative(folder_).generic_string();
      const fs::file_status status = entry->symlink_status(error);
      if (fs::is_directory(status)) continue;
      if (fs::is_regular_file(status)) {
        there_[path] = entry->file_size(error);
      } else {
        find(PackageFault::extra, path, "is a link or a device; a package holds only files");
      }
    }
    if (!error) return {};
    return fail(ErrorKind::bad_input, folder_.string(),
                fmt::format("can't be read ({})", error.message()));
  }

  /// A tag file's bytes, read once; null, with a finding, if it is missing or can't be one.
  const std::string* tag_file(const std::string& name) {
    const auto [place, is_new] = tag_files_.try_emplace(name);
    std::optional<std::string>& bytes = place->second;
    if (is_new) bytes = read_tag_file(name);
    return bytes ? &*bytes : nullptr;
  }

  std::optional<std::string> read_tag_file(const std::string& name) {
    const auto size = there_.find(name);
    if (size == there_.end()) {
      missing_[name] = "";
      return std::nullopt;
    }
    if (size->second > max_tag_bytes) {
      find(PackageFault::changed, name, "is larger than any such file");
      return std::nullopt;
    }
    auto bytes = read_file(folder_ / name);
    if (bytes) return *std::move(bytes);
    find(PackageFault::changed, name, bytes.error().what);
    return std::nullopt;
  }

  /// The same, empty where there is none.
  std::string tag_text(const std::string& name) {
    const std::string* bytes = tag_file(name);
    return bytes != nullptr ? *bytes : "";
  }

  /// The lines of a manifest; none, with a finding, if it can't be read.
  std::optional<Sums> manifest(const char* name) {
    const std::string* text = tag_file(name);
    if (text == nullptr) return std::nullopt;
    const auto lines = parse_manifest(*text, name);
    if (!lines) {
      find(PackageFault::malformed, name, lines.error().message());
      return std::nullopt;
    }
    Sums sums;
    for (const ManifestLine& line : *lines) sums[line.path] = line.sha256;
    return sums;
  }

  /// A finding if a small file's sum is another.
  void check_sum(const std::string& path, const std::string& sum, const char* what) {
    const std::string* bytes = tag_file(path);
    if (bytes == nullptr) {
      missing_[path] = sum;
    } else if (sha256_hex(*bytes) != sum) {
      find(PackageFault::changed, path, what, {{0, std::max<std::uint64_t>(1, bytes->size())}});
    }
  }

  void check_tag_files(const Sums& tags) {
    for (const char* name : {bagit_file, bag_info_file, manifest_file, blocks_file, metadata_file,
                             provenance_file, public_key_file, certificate_file}) {
      if (!tags.contains(name)) {
        find(PackageFault::malformed, tag_manifest_file, fmt::format("does not list {}", name));
      }
    }
    for (const auto& [path, sum] : tags) check_sum(path, sum, "is not as it was sealed");
    if (tag_text(bagit_file) != bagit_text) {
      find(PackageFault::malformed, bagit_file, "is not that of a BagIt 1.0 bag in UTF-8");
    }
  }

  /// Finds damage to signatures that they themselves don't cover (a CMS signature has such bytes).
  void check_signature_sums() {
    signature_files_ = manifest(signature_sums_file).value_or(Sums{});
    for (const auto& [path, sum] : signature_files_) {
      check_sum(path, sum, "is not as it was written (or signature/sha256.txt is not)");
      if (path != ed25519_file && path != cms_file && path != time_stamp_file &&
          path != audit_entry_file) {
        find(PackageFault::extra, path, "is no signature, and signature/sha256.txt lists it");
      }
    }
    for (const char* seal : {ed25519_file, cms_file}) {
      if (!signature_files_.contains(seal)) {
        find(PackageFault::malformed, signature_sums_file, fmt::format("does not list {}", seal));
      }
    }
  }

  void check_signatures() {
    const std::string public_key = tag_text(public_key_file);
    check_.ed25519_fingerprint = public_key_fingerprint(public_key);
    const std::string* ed25519 = tag_file(ed25519_file);
    check_.ed25519_valid =
        ed25519 != nullptr && ed25519_verify(public_key, tag_manifest_, *ed25519);
    if (ed25519 != nullptr && !check_.ed25519_valid) {
      find(PackageFault::signature, ed25519_file,
           fmt::format("is not the signature of {} by {}", tag_manifest_file, public_key_file));
    }
    const std::string certificate = tag_text(certificate_file);
    if (const std::string* cms = tag_file(cms_file)) {
      const auto signer = cms_verify(*cms, tag_manifest_, certificate, cms_file);
      if (signer) {
        check_.cms_signer = *signer;
      } else {
        find(PackageFault::signature, cms_file,
             fmt::format("{} (of {}, by {})", signer.error().what, tag_manifest_file,
                         certificate_file));
      }
    }
    if (trust_) check_trust(public_key, certificate);
  }

  void check_trust(const std::string& public_key, const std::string& certificate) {
    const bool by_key = check_.ed25519_valid && trusts_key(*trust_, public_key);
    Result<void> by_certificate = fail(ErrorKind::bad_input, cms_file, "is not valid");
    if (check_.cms_signer) {
      by_certificate = trusts_certificate(*trust_, certificate, check_.cms_signer->signed_at);
    }
    check_.trusted = by_key || by_certificate;
    if (*check_.trusted) return;
    find(PackageFault::trust, "signature",
         fmt::format("nobody whom you trust signed it: the Ed25519 key ({}) is not among the "
                     "trusted keys, and {}",
                     check_.ed25519_fingerprint, by_certificate.error().message()));
  }

  /// A seal that not every package has: its bytes, if it is there. It is missing where the metadata
  /// promises it.
  const std::string* optional_seal(const char* file) {
    const auto metadata = nlohmann::json::parse(tag_text(metadata_file), nullptr, false);
    const bool promised = metadata.is_object() && metadata.contains("sealed_with") &&
                          metadata["sealed_with"].is_array() &&
                          std::ranges::count(metadata["sealed_with"], file) > 0;
    return promised || there_.contains(file) ? tag_file(file) : nullptr;
  }

  void check_time_stamp() {
    const std::string* answer = optional_seal(time_stamp_file);
    if (answer == nullptr) return;
    const auto stamp = read_time_stamp(*answer, tag_text(cms_file));
    if (!stamp) {
      find(PackageFault::signature, time_stamp_file,
           fmt::format("{} (of {})", stamp.error().what, cms_file));
      return;
    }
    check_.time_stamp = *stamp;
    if (trust_) check_.time_stamp_trusted = trusts_time_stamp(*trust_, *answer).has_value();
  }

  void check_audit_entry() {
    const std::string* text = optional_seal(audit_entry_file);
    if (text == nullptr) return;
    const std::string line = text->substr(0, text->find('\n'));
    auto entry = parse_audit_entry(line, audit_entry_file);
    if (line + "\n" != *text || !entry || !audit_signature_valid(line, tag_text(public_key_file))) {
      find(PackageFault::signature, audit_entry_file,
           fmt::format("is not an audit entry that {} signed", public_key_file));
      return;
    }
    const auto details = nlohmann::ordered_json::parse(entry->details);
    if (text_at(details, "/tagmanifest_sha256") != sha256_hex(tag_manifest_)) {
      find(PackageFault::signature, audit_entry_file, "is the audit entry of another package");
      return;
    }
    check_.audit_entry = *std::move(entry);
  }

  Result<void> check_payload(const Sums& payload) {
    check_.files = payload.size();
    std::uint64_t total = 1;
    for (const auto& [path, size] : there_) total += is_payload(path) ? size : 0;
    const auto blocks = parse_block_list(tag_text(blocks_file), blocks_file);
    if (!blocks) find(PackageFault::malformed, blocks_file, blocks.error().message());
    const std::map<std::string, FileDigest> recorded =
        blocks.value_or(std::map<std::string, FileDigest>{});
    const auto count = [&](std::uint64_t more) {
      check_.bytes += more;
      progress_.report(static_cast<double>(check_.bytes) / static_cast<double>(total), "checking");
    };
    for (const auto& [path, sum] : payload) {
      if (!is_payload(path)) {
        find(PackageFault::malformed, manifest_file, fmt::format("lists {}, no payload", path));
        continue;
      }
      if (!there_.contains(path)) {
        missing_[path] = sum;
        continue;
      }
      const auto now = digest_file(folder_ / path, false, progress_.stop, count);
      if (!now && now.error().kind == ErrorKind::cancelled) return forward(now);
      if (!now) {
        find(PackageFault::changed, path, now.error().what);
      } else if (now->sha256 != sum) {
        const auto file = recorded.find(path);
        find_change(path, file != recorded.end() ? &file->second : nullptr);
      }
    }
    return {};
  }

  /// Tells where a payload file differs: its second reading, with the sums of its blocks.
  void find_change(const std::string& path, const FileDigest* recorded) {
    const auto now = digest_file(folder_ / path, true, progress_.stop);
    std::string what = "is not as it was sealed";
    if (!now || recorded == nullptr) {
      return find(PackageFault::changed, path,
                  fmt::format("{}; {} does not tell where", what, blocks_file));
    }
    std::vector<ByteRange> ranges = changed_ranges(*recorded, *now);
    if (ranges.empty()) {
      what = fmt::format("does not agree with {}, but with {}: one of these is damaged",
                         manifest_file, blocks_file);
    }
    if (now->bytes != recorded->bytes) {
      what += fmt::format("; it had {} bytes and has {}", recorded->bytes, now->bytes);
    }
    find(PackageFault::changed, path, std::move(what), std::move(ranges));
  }

  /// Files that no manifest lists: new ones, or missing ones under another name.
  void find_strangers(const std::optional<Sums>& tags, const std::optional<Sums>& payload) {
    for (const auto& [path, size] : there_) {
      const std::optional<Sums>& listed = is_payload(path) ? payload : tags;
      // Without its manifest nobody can tell a stranger.
      if (!listed || listed->contains(path) || signature_files_.contains(path) ||
          path == tag_manifest_file || path == signature_sums_file) {
        continue;
      }
      const auto now = digest_file(folder_ / path, false, progress_.stop);
      const auto old = std::ranges::find_if(
          missing_, [&](const auto& file) { return now && file.second == now->sha256; });
      if (old == missing_.end()) {
        find(PackageFault::extra, path, "was not sealed; somebody put it in");
      } else {
        find(PackageFault::renamed, path, fmt::format("was sealed as {}", old->first));
        missing_.erase(old);
      }
    }
    for (const auto& [path, sum] : missing_) find(PackageFault::missing, path, "is missing");
  }

  void read_names() {
    if (!there_.contains(metadata_file)) return;
    const auto metadata = nlohmann::ordered_json::parse(tag_text(metadata_file), nullptr, false);
    if (metadata.is_discarded()) return;
    check_.case_number = text_at(metadata, "/case");
    check_.station = text_at(metadata, "/station");
  }

  fs::path folder_;
  const std::optional<Trust>& trust_;
  const Progress& progress_;
  PackageCheck check_;
  std::map<std::string, std::uint64_t> there_;  ///< every file of the bag, with its size
  std::map<std::string, std::optional<std::string>> tag_files_;  ///< those that were read
  std::string tag_manifest_;
  Sums signature_files_;
  Sums missing_;  ///< with the sum that each had, if that is known
};

}  // namespace

const char* to_string(PackageFault fault) {
  switch (fault) {
    case PackageFault::changed: return "changed";
    case PackageFault::missing: return "missing";
    case PackageFault::extra: return "extra";
    case PackageFault::renamed: return "renamed";
    case PackageFault::malformed: return "malformed";
    case PackageFault::signature: return "signature";
    case PackageFault::trust: return "trust";
  }
  return "";
}

Result<PackageCheck> check_package(const fs::path& folder, const std::optional<Trust>& trust,
                                   const Progress& progress) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    return fail(ErrorKind::bad_input, folder.string(), "is no folder; a package was expected");
  }
  return PackageReader(folder, trust, progress).check();
}

}  // namespace skullstation
