#include "daemon/evidence/package.h"

#include <fmt/format.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "core/file.h"
#include "core/staged_folder.h"
#include "daemon/evidence/bag_manifest.h"
#include "daemon/evidence/cms_signature.h"
#include "daemon/evidence/provenance.h"
#include "daemon/evidence/sealed_copy.h"
#include "daemon/evidence/signature.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// Tag files and signatures are small; this is for them and the folders.
constexpr std::uint64_t spare_bytes = std::uint64_t{16} * 1024 * 1024;

using SealedFiles = std::map<std::string, FileDigest>;

Result<void> check_place(const PackageSource& source, const fs::path& out) {
  if (const auto free = check_new_folder(out); !free) return forward(free);
  const auto whole = [](const fs::path& path) {
    std::error_code ignored;
    const fs::path resolved = fs::weakly_canonical(fs::absolute(path), ignored);
    return resolved.has_filename() ? resolved : resolved.parent_path();
  };
  std::vector<fs::path> parts = {source.case_folder};
  if (source.session) parts.push_back(*source.session);
  if (source.reconstruction) parts.push_back(*source.reconstruction);
  for (const fs::path& part : parts) {
    const fs::path inside = whole(out).lexically_relative(whole(part));
    if (!inside.empty() && *inside.begin() != "..") {
      return fail(ErrorKind::usage, out.string(),
                  fmt::format("lies in {}, which is to be sealed", part.string()),
                  "name a folder outside of it");
    }
  }
  return {};
}

Result<void> check_space(const PackageContent& content, const StagedFolder& staged) {
  const auto free = free_space_bytes(staged.path());
  if (!free) return forward(free);
  if (*free >= content.bytes + spare_bytes) return {};
  return fail(ErrorKind::bad_input, staged.path().parent_path().string(),
              fmt::format("has {} MB of free space; the package needs {} MB", *free / 1'000'000,
                          (content.bytes + spare_bytes) / 1'000'000),
              "free some space on this volume, or name another");
}

Result<SealedFiles> copy_payload(const PackageContent& content, const StagedFolder& staged,
                                 int threads, const Progress& progress) {
  SealedFiles sealed;
  std::set<fs::path> folders;
  std::uint64_t done = 0;
  for (const PayloadFile& file : content.files) {
    const fs::path to = staged / file.bag_path;
    if (folders.insert(to.parent_path()).second) {
      if (const auto made = make_writable_folder(to.parent_path()); !made) return forward(made);
    }
    auto digest = copy_sealed(file.source, to, threads, progress.stop, [&](std::uint64_t more) {
      done += more;
      progress.report(static_cast<double>(done) / static_cast<double>(content.bytes),
                      "sealing " + file.source.filename().string());
    });
    if (!digest) return forward(digest);
    if (digest->bytes != file.bytes) {
      return fail(ErrorKind::bad_input, file.source.string(), "changed while it was sealed",
                  "wait until whoever writes to it is done");
    }
    sealed.emplace(file.bag_path, *std::move(digest));
  }
  for (const fs::path& folder : folders) {
    for (fs::path parent = folder; parent != staged.path(); parent = parent.parent_path()) {
      if (const auto synced = sync_folder(parent); !synced) return forward(synced);
    }
  }
  return sealed;
}

/// Writes tag files and keeps their sums for a manifest.
class TagFiles {
 public:
  explicit TagFiles(const StagedFolder& staged) : staged_(staged) {}

  Result<void> write(const char* name, const std::string& bytes) {
    sums_[name] = sha256_hex(bytes);
    return write_file_durably(staged_ / name, bytes);
  }
  std::string manifest() const {
    std::vector<ManifestLine> lines;
    for (const auto& [path, sum] : sums_) lines.push_back({path, sum});
    return format_manifest(lines);
  }

 private:
  const StagedFolder& staged_;
  std::map<std::string, std::string> sums_;
};

/// Everything that the tag manifest lists; returns that manifest.
Result<std::string> write_tags(const PackageContent& content, const SealedFiles& sealed,
                               const Seal& seal, const StagedFolder& staged) {
  std::vector<ManifestLine> payload;
  for (const auto& [path, digest] : sealed) payload.push_back({path, digest.sha256});
  std::vector<std::string> seals = {ed25519_file, cms_file};
  if (seal.time_stamper) seals.emplace_back(time_stamp_file);
  if (seal.audit_log) seals.emplace_back(audit_entry_file);
  const StationKeys& keys = seal.keys;
  const auto owner = certificate_owner(keys.certificate_pem);
  TagFiles tags(staged);
  for (const auto& written :
       {tags.write(bagit_file, bagit_text), tags.write(bag_info_file, bag_info(content)),
        tags.write(manifest_file, format_manifest(payload)),
        tags.write(blocks_file, format_block_list(sealed)),
        tags.write(metadata_file,
                   metadata_json(content, seals, public_key_fingerprint(keys.ed25519_public_pem),
                                 owner ? owner->fingerprint : "")),
        tags.write(provenance_file, provenance_json(content, sealed)),
        tags.write(public_key_file, keys.ed25519_public_pem),
        tags.write(certificate_file, keys.certificate_pem)}) {
    if (!written) return forward(written);
  }
  std::string manifest = tags.manifest();
  if (const auto written = write_file_durably(staged / tag_manifest_file, manifest); !written) {
    return forward(written);
  }
  return manifest;
}

/// The authority's answer about the signature.
Result<std::string> stamped(const TimeStamper& time_stamper, const std::string& signature) {
  const std::string query = time_stamp_query(signature);
  auto answer = time_stamper(query);
  if (!answer) {
    answer.error().where = "time stamp of " + answer.error().where;
    return answer;
  }
  if (const auto stamp = read_time_stamp(*answer, signature, query); !stamp) return forward(stamp);
  return answer;
}

AuditEvent audit_event(const PackageSummary& summary, const std::string& who) {
  return {who, "package", summary.case_number,
          nlohmann::ordered_json{{"files", summary.files},
                                 {"bytes", summary.bytes},
                                 {"tagmanifest_sha256", summary.tag_manifest_sha256}}
              .dump()};
}

}  // namespace

Result<PackageSummary> write_package(const PackageSource& source, const Seal& seal,
                                     const Clock& clock, const fs::path& out, int threads,
                                     const Progress& progress) {
  if (const auto place = check_place(source, out); !place) return forward(place);
  const auto content = read_package_source(source);
  if (!content) return forward(content);

  StagedFolder staged(out);
  if (const auto made = make_writable_folder(staged / "signature"); !made) return forward(made);
  if (const auto space = check_space(*content, staged); !space) return forward(space);
  const auto sealed = copy_payload(*content, staged, threads, progress);
  if (!sealed) return forward(sealed);
  std::map<std::string, std::string> sums;
  for (const auto& [path, digest] : *sealed) sums[path] = digest.sha256;
  if (const auto linked = content->check_links(sums); !linked) return forward(linked);

  const auto tag_manifest = write_tags(*content, *sealed, seal, staged);
  if (!tag_manifest) return forward(tag_manifest);
  const PackageSummary summary = {content->case_number, content->files.size(), content->bytes,
                                  sha256_hex(*tag_manifest)};
  const auto cms = cms_sign(seal.keys, *tag_manifest, clock.utc_now());
  if (!cms) return forward(cms);
  TagFiles signatures(staged);
  for (const auto& written :
       {signatures.write(ed25519_file, ed25519_sign(seal.keys, *tag_manifest)),
        signatures.write(cms_file, *cms)}) {
    if (!written) return forward(written);
  }
  if (seal.time_stamper) {
    const auto stamp = stamped(seal.time_stamper, *cms);
    if (!stamp) return forward(stamp);
    if (const auto written = signatures.write(time_stamp_file, *stamp); !written) {
      return forward(written);
    }
  }
  if (seal.audit_log) {
    AuditLogPlace log = *seal.audit_log;
    if (log.station.empty()) log.station = content->station;
    const auto entry = append_audit_entry(log, audit_event(summary, seal.who), seal.keys, clock);
    if (!entry) return forward(entry);
    if (const auto written = signatures.write(audit_entry_file, *entry + "\n"); !written) {
      return forward(written);
    }
  }
  if (const auto written = write_file_durably(staged / signature_sums_file, signatures.manifest());
      !written) {
    return forward(written);
  }
  if (const auto placed = staged.put_in_place(); !placed) return forward(placed);
  return summary;
}

}  // namespace skullstation
