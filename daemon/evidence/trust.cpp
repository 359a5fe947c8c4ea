#include "daemon/evidence/trust.h"

#include <fmt/format.h>
#include <openssl/pem.h>

#include <algorithm>

#include "core/file.h"
#include "daemon/evidence/certificate.h"
#include "daemon/evidence/openssl_handles.h"
#include "daemon/evidence/signature.h"

namespace skullstation {

namespace {

CertificateHandle certificate_of(std::string_view pem) {
  return next_certificate(reading_from(pem));
}

std::string pem_of(X509* certificate) {
  const BioHandle bio = collecting();
  PEM_write_bio_X509(bio.get(), certificate);
  return collected(bio);
}

std::string public_pem_of(X509* certificate) {
  const BioHandle bio = collecting();
  PEM_write_bio_PUBKEY(bio.get(), X509_get0_pubkey(certificate));
  return collected(bio);
}

/// All certificates of a text, in its order.
std::vector<std::string> certificates_in(std::string_view text) {
  std::vector<std::string> found;
  const BioHandle bio = reading_from(text);
  while (const CertificateHandle certificate = next_certificate(bio)) {
    found.push_back(pem_of(certificate.get()));
  }
  return found;
}

}  // namespace

Result<Trust> read_trust(const std::filesystem::path& file) {
  const auto text = read_file(file);
  if (!text) return forward(text);
  Trust trust;
  trust.certificates_pem = certificates_in(*text);
  const BioHandle bio = reading_from(*text);
  while (const KeyHandle key{PEM_read_bio_PUBKEY(bio.get(), nullptr, nullptr, nullptr)}) {
    const BioHandle pem = collecting();
    PEM_write_bio_PUBKEY(pem.get(), key.get());
    trust.public_keys_pem.push_back(collected(pem));
  }
  ERR_clear_error();
  if (trust.certificates_pem.empty() && trust.public_keys_pem.empty()) {
    return fail(ErrorKind::bad_input, file.string(),
                "holds neither a certificate nor a public key in PEM",
                "give the station's ed25519.pub.pem or certificate.pem, or its authority's "
                "certificate");
  }
  return trust;
}

bool trusts_key(const Trust& trust, std::string_view public_pem) {
  const std::string wanted = public_key_fingerprint(public_pem);
  return !wanted.empty() &&
         std::ranges::any_of(trust.public_keys_pem, [&](const std::string& known) {
           return public_key_fingerprint(known) == wanted;
         });
}

Result<void> trusts_certificate(const Trust& trust, std::string_view chain_pem, UtcTime time) {
  const std::vector<std::string> chain = certificates_in(chain_pem);
  if (chain.empty()) {
    return fail(ErrorKind::bad_input, "certificate.pem", "is no certificate in PEM");
  }
  const CertificateHandle leaf = certificate_of(chain.front());
  if (trusts_key(trust, public_pem_of(leaf.get()))) return {};
  STACK_OF(X509)* between = sk_X509_new_null();
  for (std::size_t i = 1; i < chain.size(); ++i) {
    sk_X509_push(between, certificate_of(chain[i]).release());
  }
  auto trusted = leads_to_trusted(trust, leaf.get(), between, time);
  sk_X509_pop_free(between, X509_free);
  if (!trusted) trusted.error().where = "certificate.pem";
  return trusted;
}

Result<void> leads_to_trusted(const Trust& trust, X509* leaf, STACK_OF(X509) * between,
                              UtcTime time, int purpose) {
  const CertificateStoreHandle store(X509_STORE_new());
  for (const std::string& pem : trust.certificates_pem) {
    X509_STORE_add_cert(store.get(), certificate_of(pem).get());
  }
  const StoreContextHandle context(X509_STORE_CTX_new());
  X509_STORE_CTX_init(context.get(), store.get(), leaf, between);
  if (purpose != 0) X509_STORE_CTX_set_purpose(context.get(), purpose);
  // The signer's own certificate in the examiner's hand is enough. Its validity is judged at the
  // time of signing: it may have expired since.
  X509_STORE_CTX_set_flags(context.get(), X509_V_FLAG_PARTIAL_CHAIN);
  X509_STORE_CTX_set_time(context.get(), 0, std::chrono::system_clock::to_time_t(time));
  const bool trusted = X509_verify_cert(context.get()) == 1;
  const int reason = X509_STORE_CTX_get_error(context.get());
  ERR_clear_error();
  if (trusted) return {};
  return fail(ErrorKind::bad_input, subject_of(leaf),
              fmt::format("does not lead to a trusted certificate ({})",
                          X509_verify_cert_error_string(reason)));
}

}  // namespace skullstation
