#include "daemon/http/tls_certificate.h"

#include <fmt/format.h>
#include <openssl/pem.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cctype>

#include "core/file.h"
#include "daemon/evidence/openssl_handles.h"
#include "daemon/evidence/self_signed.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

std::string host_name() {
  std::array<char, 256> name{};
  if (::gethostname(name.data(), name.size() - 1) != 0) return "skullstation";
  std::string text(name.data());
  // What a certificate may carry as a name in the network.
  std::erase_if(text, [](unsigned char c) { return std::isalnum(c) == 0 && c != '-' && c != '.'; });
  return text.empty() || text.size() > 60 ? "skullstation" : text;
}

std::string fingerprint_of(X509* certificate) {
  std::array<unsigned char, EVP_MAX_MD_SIZE> digest{};
  unsigned int size = 0;
  X509_digest(certificate, EVP_sha256(), digest.data(), &size);
  std::string text;
  for (unsigned int i = 0; i < size; ++i) {
    text += fmt::format("{}{:02X}", i == 0 ? "" : ":", digest[i]);
  }
  return text;
}

Result<void> make_own(const fs::path& folder, const Clock& clock) {
  if (auto made = make_writable_folder(folder); !made) return forward(made);
  ::chmod(folder.c_str(), 0700);
  const std::string host = host_name();
  const KeyHandle key = generate_p256();
  CertificateWish wish;
  wish.name = host;
  wish.key_usage = "critical,digitalSignature";
  wish.reachable = {"DNS:localhost", "DNS:" + host, "IP:127.0.0.1", "IP:::1"};
  const std::string certificate = self_signed_certificate(key.get(), wish, clock.utc_now());
  if (certificate.empty()) {
    return fail(ErrorKind::no_result, folder.string(),
                "no certificate could be made: " + openssl_reason());
  }
  // The key of a crash in between belongs to no certificate.
  std::error_code ignored;
  fs::remove(folder / "key.pem", ignored);
  if (auto written = write_private_file(folder / "key.pem", private_pem(key)); !written) {
    return written;
  }
  return write_file_durably(folder / "certificate.pem", certificate);
}

}  // namespace

Result<TlsCertificate> own_certificate(const fs::path& folder, const Clock& clock) {
  const fs::path chain = folder / "certificate.pem";
  if (!fs::exists(chain)) {
    if (auto made = make_own(folder, clock); !made) return forward(made);
  }
  return read_certificate(chain, folder / "key.pem");
}

Result<TlsCertificate> read_certificate(const fs::path& chain, const fs::path& key) {
  TlsCertificate read;
  auto chain_pem = read_file(chain);
  if (!chain_pem) return forward(chain_pem);
  auto key_pem = read_file(key);
  if (!key_pem) return forward(key_pem);
  struct stat status {};
  if (::stat(key.c_str(), &status) == 0 && (status.st_mode & 077) != 0) {
    return fail(ErrorKind::bad_input, key.string(),
                fmt::format("is a private key that others may read or write (mode {:o})",
                            status.st_mode & 0777),
                fmt::format("`chmod 600 {}`", key.string()));
  }
  const BioHandle chain_bio = reading_from(*chain_pem);
  const CertificateHandle first(PEM_read_bio_X509(chain_bio.get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  if (!first) return fail(ErrorKind::bad_input, chain.string(), "holds no certificate in PEM");
  const BioHandle key_bio = reading_from(*key_pem);
  const auto no_passphrase = [](char*, int, int, void*) { return 0; };
  const KeyHandle private_key(
      PEM_read_bio_PrivateKey(key_bio.get(), nullptr, no_passphrase, nullptr));
  ERR_clear_error();
  if (!private_key) {
    return fail(ErrorKind::bad_input, key.string(), "holds no unencrypted private key in PEM");
  }
  if (EVP_PKEY_eq(X509_get0_pubkey(first.get()), private_key.get()) != 1) {
    return fail(ErrorKind::bad_input, chain.string(),
                fmt::format("its first certificate does not belong to the key {}", key.string()),
                "put the server's own certificate first, its authorities after it");
  }
  read.fingerprint = fingerprint_of(first.get());
  read.chain_pem = *std::move(chain_pem);
  read.key_pem = *std::move(key_pem);
  return read;
}

}  // namespace skullstation
