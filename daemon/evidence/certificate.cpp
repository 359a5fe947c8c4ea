#include "daemon/evidence/certificate.h"

#include <openssl/pem.h>

#include <ctime>

namespace skullstation {

CertificateHandle next_certificate(const BioHandle& pem) {
  CertificateHandle certificate(PEM_read_bio_X509(pem.get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return certificate;
}

std::string subject_of(const X509* certificate) {
  const BioHandle bio = collecting();
  X509_NAME_print_ex(bio.get(), X509_get_subject_name(certificate), 0,
                     XN_FLAG_ONELINE & ~ASN1_STRFLGS_ESC_MSB);
  return collected(bio);
}

std::optional<UtcTime> utc_of(const ASN1_TIME* time) {
  std::tm broken{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &broken) != 1) return std::nullopt;
  return std::chrono::system_clock::from_time_t(::timegm(&broken));
}

}  // namespace skullstation
