#include "daemon/evidence/self_signed.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <ctime>

#include "core/file_descriptor.h"

namespace skullstation {

namespace {

void add_extension(X509* certificate, int nid, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, certificate, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value);
  X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
}

}  // namespace

KeyHandle generate_p256() { return KeyHandle(EVP_PKEY_Q_keygen(nullptr, nullptr, "EC", "P-256")); }

std::string private_pem(const KeyHandle& key) {
  const BioHandle bio = collecting();
  PEM_write_bio_PrivateKey(bio.get(), key.get(), nullptr, nullptr, 0, nullptr, nullptr);
  return collected(bio);
}

std::string self_signed_certificate(EVP_PKEY* key, const CertificateWish& wish, UtcTime now) {
  const CertificateHandle certificate(X509_new());
  X509_set_version(certificate.get(), X509_VERSION_3);
  std::array<unsigned char, 16> serial{};
  RAND_bytes(serial.data(), static_cast<int>(serial.size()));
  serial[0] &= 0x7f;
  BIGNUM* number = BN_bin2bn(serial.data(), static_cast<int>(serial.size()), nullptr);
  BN_to_ASN1_INTEGER(number, X509_get_serialNumber(certificate.get()));
  BN_free(number);
  const std::time_t from = std::chrono::system_clock::to_time_t(now);
  ASN1_TIME_adj(X509_getm_notBefore(certificate.get()), from, 0, 0);
  ASN1_TIME_adj(X509_getm_notAfter(certificate.get()), from, wish.valid_days, 0);
  X509_NAME* name = X509_get_subject_name(certificate.get());
  const auto* text = reinterpret_cast<const unsigned char*>(wish.name.data());
  if (X509_NAME_add_entry_by_txt(name, "CN", MBSTRING_UTF8, text,
                                 static_cast<int>(wish.name.size()), -1, 0) != 1) {
    return {};
  }
  X509_set_issuer_name(certificate.get(), name);
  X509_set_pubkey(certificate.get(), key);
  add_extension(certificate.get(), NID_basic_constraints, "critical,CA:FALSE");
  add_extension(certificate.get(), NID_key_usage, wish.key_usage.c_str());
  add_extension(certificate.get(), NID_subject_key_identifier, "hash");
  if (!wish.reachable.empty()) {
    add_extension(certificate.get(), NID_ext_key_usage, "serverAuth");
    add_extension(certificate.get(), NID_subject_alt_name,
                  fmt::format("{}", fmt::join(wish.reachable, ",")).c_str());
  }
  if (X509_sign(certificate.get(), key, EVP_sha256()) == 0) return {};
  const BioHandle bio = collecting();
  PEM_write_bio_X509(bio.get(), certificate.get());
  return collected(bio);
}

Result<void> write_private_file(const std::filesystem::path& path, std::string_view pem) {
  const FileDescriptor file(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0600));
  if (file.get() < 0) return write_error(path, errno);
  if (const int failure = write_all(file, pem); failure != 0) return write_error(path, failure);
  if (::fsync(file.get()) != 0) return write_error(path, errno);
  return {};
}

}  // namespace skullstation
