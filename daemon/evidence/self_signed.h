#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/evidence/openssl_handles.h"

namespace skullstation {

/// What a certificate that a key makes for itself says.
struct CertificateWish {
  std::string name;  ///< CN; 64 characters at most
  int valid_days = 3650;
  std::string key_usage;               ///< in OpenSSL's words: "critical,digitalSignature"
  std::vector<std::string> reachable;  ///< "DNS:localhost", "IP:127.0.0.1"; of a server
};

KeyHandle generate_p256();
std::string private_pem(const KeyHandle& key);

/// In PEM; empty if OpenSSL refuses (a name too long).
std::string self_signed_certificate(EVP_PKEY* key, const CertificateWish& wish, UtcTime now);

/// A new file for this user alone (0600), on the disk when this returns.
Result<void> write_private_file(const std::filesystem::path& path, std::string_view pem);

}  // namespace skullstation
