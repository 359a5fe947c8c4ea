#include "daemon/evidence/station_keys.h"

#include <fmt/format.h>
#include <openssl/pem.h>
#include <sys/stat.h>

#include <cerrno>

#include "core/file.h"
#include "core/staged_folder.h"
#include "daemon/evidence/openssl_handles.h"
#include "daemon/evidence/self_signed.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

constexpr const char* ed25519_key_file = "ed25519.key";
constexpr const char* ed25519_public_file = "ed25519.pub.pem";
constexpr const char* p256_key_file = "p256.key";
constexpr const char* certificate_file = "certificate.pem";

/// A key is asked for by nobody's presence: an encrypted one is refused instead of prompting.
int no_passphrase(char*, int, int, void*) { return 0; }

KeyHandle generate_ed25519() { return KeyHandle(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519")); }

std::string public_pem(EVP_PKEY* key) {
  const BioHandle bio = collecting();
  PEM_write_bio_PUBKEY(bio.get(), key);
  return collected(bio);
}

/// `kind`: an EVP_PKEY_... number, `name` its name for people.
Result<std::shared_ptr<EVP_PKEY>> read_private(const fs::path& path, int kind, const char* name) {
  struct stat status {};
  if (::stat(path.c_str(), &status) == 0 && (status.st_mode & 077) != 0) {
    return fail(ErrorKind::bad_input, path.string(),
                fmt::format("is a private key that others may read or write (mode {:o})",
                            status.st_mode & 0777),
                fmt::format("take it as known to others: make new keys with `skullstation keys "
                            "create`, or, if nobody else was on this machine, `chmod 600 {}`",
                            path.string()));
  }
  const auto pem = read_file(path);
  if (!pem) return forward(pem);
  const BioHandle bio = reading_from(*pem);
  std::shared_ptr<EVP_PKEY> key(PEM_read_bio_PrivateKey(bio.get(), nullptr, no_passphrase, nullptr),
                                EVP_PKEY_free);
  ERR_clear_error();
  if (pem->find("ENCRYPTED") != std::string::npos) {
    return fail(ErrorKind::bad_input, path.string(), "is encrypted",
                "the station signs while nobody is there to type a passphrase: give the key "
                "without one, on an encrypted disk");
  }
  if (!key || EVP_PKEY_get_base_id(key.get()) != kind) {
    return fail(ErrorKind::bad_input, path.string(), fmt::format("is no {} key in PEM", name),
                "`skullstation keys create` makes one");
  }
  return key;
}

}  // namespace

Result<void> create_station_keys(const fs::path& folder, const NewStationKeys& wanted,
                                 const Clock& clock) {
  if (wanted.station.empty()) {
    return fail(ErrorKind::usage, "--station", "is empty; the keys' certificate needs a name");
  }
  if (const auto free = check_new_folder(folder); !free) return forward(free);
  const KeyHandle ed25519 = generate_ed25519();
  const KeyHandle p256 = generate_p256();
  const std::string certificate = self_signed_certificate(
      p256.get(),
      {wanted.station, wanted.valid_days, "critical,digitalSignature,nonRepudiation", {}},
      clock.utc_now());
  if (certificate.empty()) {
    return fail(ErrorKind::usage, "--station",
                fmt::format("no certificate can carry the name \"{}\" ({})", wanted.station,
                            openssl_reason()),
                "it may have 64 characters");
  }
  StagedFolder staged(folder);
  if (const auto made = staged.make(); !made) return forward(made);
  ::chmod(staged.path().c_str(), 0700);
  for (const auto& written :
       {write_private_file(staged / ed25519_key_file, private_pem(ed25519)),
        write_private_file(staged / p256_key_file, private_pem(p256)),
        write_file_durably(staged / ed25519_public_file, public_pem(ed25519.get())),
        write_file_durably(staged / certificate_file, certificate)}) {
    if (!written) return written;
  }
  return staged.put_in_place();
}

Result<StationKeys> read_station_keys(const fs::path& folder) {
  std::error_code ignored;
  if (!fs::is_directory(folder, ignored)) {
    return fail(ErrorKind::bad_input, folder.string(), "holds no keys to sign with",
                fmt::format("make them once: `skullstation keys create {} --station NAME`",
                            folder.string()));
  }
  StationKeys keys;
  auto ed25519 = read_private(folder / ed25519_key_file, EVP_PKEY_ED25519, "Ed25519");
  if (!ed25519) return forward(ed25519);
  keys.ed25519 = *std::move(ed25519);
  keys.ed25519_public_pem = public_pem(keys.ed25519.get());
  auto p256 = read_private(folder / p256_key_file, EVP_PKEY_EC, "P-256");
  if (!p256) return forward(p256);
  keys.p256 = *std::move(p256);
  auto certificate_pem = read_file(folder / certificate_file);
  if (!certificate_pem) return forward(certificate_pem);
  keys.certificate_pem = *std::move(certificate_pem);
  const BioHandle bio = reading_from(keys.certificate_pem);
  const CertificateHandle certificate(PEM_read_bio_X509(bio.get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  if (!certificate) {
    return fail(ErrorKind::bad_input, (folder / certificate_file).string(),
                "is no certificate in PEM");
  }
  if (EVP_PKEY_eq(X509_get0_pubkey(certificate.get()), keys.p256.get()) != 1) {
    return fail(ErrorKind::bad_input, (folder / certificate_file).string(),
                fmt::format("does not belong to {}", p256_key_file),
                "its first certificate must be that key's own; authorities follow it");
  }
  return keys;
}

}  // namespace skullstation
