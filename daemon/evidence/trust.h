#pragma once

#include <openssl/x509.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

/// Keys that an examiner got by another way than the package: certificates (a station's own or its
/// authority's) and public keys, in PEM, any number of them in one file.
struct Trust {
  std::vector<std::string> certificates_pem;
  std::vector<std::string> public_keys_pem;
};

Result<Trust> read_trust(const std::filesystem::path& file);

/// Is the public key one of the trusted keys?
bool trusts_key(const Trust& trust, std::string_view public_pem);

/// Does the first certificate of `chain_pem` lead, at `time`, to a trusted certificate, or is its
/// key a trusted key? Says why not.
Result<void> trusts_certificate(const Trust& trust, std::string_view chain_pem, UtcTime time);

/// The same of a certificate by itself, over those `between`; `purpose` as OpenSSL has it
/// (X509_PURPOSE_TIMESTAMP_SIGN), 0: any.
Result<void> leads_to_trusted(const Trust& trust, X509* leaf, STACK_OF(X509) * between,
                              UtcTime time, int purpose = 0);

}  // namespace skullstation
