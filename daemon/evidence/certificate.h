#pragma once

#include <openssl/x509.h>

#include <optional>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "daemon/evidence/openssl_handles.h"

namespace skullstation {

/// The next certificate of a text in PEM; null after the last.
CertificateHandle next_certificate(const BioHandle& pem);

/// "CN = ST-01"
std::string subject_of(const X509* certificate);

std::optional<UtcTime> utc_of(const ASN1_TIME* time);

}  // namespace skullstation
