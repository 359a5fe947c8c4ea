#include "daemon/evidence/cms_signature.h"

#include <fmt/format.h>
#include <ctime>

#include "core/file.h"
#include "daemon/evidence/certificate.h"
#include "daemon/evidence/openssl_handles.h"

namespace skullstation {

namespace {

std::string der_of(X509* certificate) {
  const BioHandle bio = collecting();
  i2d_X509_bio(bio.get(), certificate);
  return collected(bio);
}

std::string print(const ASN1_TIME* time) {
  const BioHandle bio = collecting();
  ASN1_TIME_print(bio.get(), time);
  return collected(bio);
}

std::optional<UtcTime> signing_time(CMS_SignerInfo* signer) {
  auto* value = static_cast<ASN1_TYPE*>(
      CMS_signed_get0_data_by_OBJ(signer, OBJ_nid2obj(NID_pkcs9_signingTime), -3, V_ASN1_UTCTIME));
  if (value == nullptr) {
    value = static_cast<ASN1_TYPE*>(CMS_signed_get0_data_by_OBJ(
        signer, OBJ_nid2obj(NID_pkcs9_signingTime), -3, V_ASN1_GENERALIZEDTIME));
  }
  ERR_clear_error();
  return utc_of(reinterpret_cast<ASN1_TIME*>(value));
}

tl::unexpected<Error> not_verified(std::string_view name, std::string what) {
  return fail(ErrorKind::bad_input, std::string(name), std::move(what));
}

}  // namespace

Result<std::string> cms_sign(const StationKeys& keys, std::string_view message, UtcTime now) {
  const BioHandle pem = reading_from(keys.certificate_pem);
  const CertificateHandle certificate = next_certificate(pem);
  std::time_t seconds = std::chrono::system_clock::to_time_t(now);
  if (X509_cmp_time(X509_get0_notBefore(certificate.get()), &seconds) > 0 ||
      X509_cmp_time(X509_get0_notAfter(certificate.get()), &seconds) < 0) {
    return fail(ErrorKind::bad_input, "certificate.pem",
                fmt::format("is valid from {} to {}, and this station's clock says {}",
                            print(X509_get0_notBefore(certificate.get())),
                            print(X509_get0_notAfter(certificate.get())), to_iso8601(now)),
                "set the clock, or make new keys with `skullstation keys create`");
  }
  const unsigned flags = CMS_BINARY | CMS_DETACHED | CMS_NOSMIMECAP | CMS_PARTIAL;
  const CmsHandle cms(CMS_sign(nullptr, nullptr, nullptr, nullptr, flags));
  CMS_SignerInfo* signer =
      CMS_add1_signer(cms.get(), certificate.get(), keys.p256.get(), EVP_sha256(), flags);
  while (const CertificateHandle authority = next_certificate(pem)) {
    CMS_add1_cert(cms.get(), authority.get());
  }
  const TimeHandle time(ASN1_TIME_set(nullptr, seconds));
  const BioHandle content = reading_from(message);
  const BioHandle der = collecting();
  if (signer == nullptr ||
      CMS_signed_add1_attr_by_NID(signer, NID_pkcs9_signingTime, time->type, time.get(), -1) != 1 ||
      CMS_final(cms.get(), content.get(), nullptr, flags) != 1 ||
      i2d_CMS_bio(der.get(), cms.get()) != 1) {
    return fail(ErrorKind::bad_input, "p256.key",
                fmt::format("can't sign with its certificate ({})", openssl_reason()));
  }
  return collected(der);
}

Result<CmsSigner> cms_verify(std::string_view der, std::string_view message,
                             std::string_view certificate_pem, std::string_view name) {
  const BioHandle signature = reading_from(der);
  const CmsHandle cms(d2i_CMS_bio(signature.get(), nullptr));
  if (!cms || OBJ_obj2nid(CMS_get0_type(cms.get())) != NID_pkcs7_signed) {
    ERR_clear_error();
    return not_verified(name, "is no CMS signature in DER");
  }
  const BioHandle pem = reading_from(certificate_pem);
  const CertificateHandle certificate = next_certificate(pem);
  if (!certificate) return not_verified(name, "can't be checked: its certificate is unreadable");
  const BioHandle content = reading_from(message);
  // The certificate beside the signature is the one that counts, not any inside the signature.
  const unsigned flags = CMS_BINARY | CMS_NO_SIGNER_CERT_VERIFY | CMS_NOINTERN;
  STACK_OF(X509)* expected = sk_X509_new_null();
  sk_X509_push(expected, certificate.get());
  const bool valid = CMS_verify(cms.get(), expected, nullptr, content.get(), nullptr, flags) == 1;
  sk_X509_free(expected);
  STACK_OF(CMS_SignerInfo)* signers = CMS_get0_SignerInfos(cms.get());
  if (!valid || sk_CMS_SignerInfo_num(signers) != 1) {
    return not_verified(name,
                        fmt::format("is not the signature of these bytes ({})", openssl_reason()));
  }
  const auto time = signing_time(sk_CMS_SignerInfo_value(signers, 0));
  if (!time) return not_verified(name, "holds no signing time");
  CmsSigner signer = *certificate_owner(certificate_pem);
  signer.signed_at = *time;
  signer.signing_time = to_iso8601(*time);
  return signer;
}

std::optional<CmsSigner> certificate_owner(std::string_view certificate_pem) {
  const BioHandle pem = reading_from(certificate_pem);
  const CertificateHandle certificate = next_certificate(pem);
  if (!certificate) return std::nullopt;
  CmsSigner owner;
  owner.name = subject_of(certificate.get());
  owner.fingerprint = sha256_hex(der_of(certificate.get()));
  return owner;
}

}  // namespace skullstation
