#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

/// Detached CMS signature (RFC 5652) in DER: ECDSA P-256, SHA-256, the signing time as a signed
/// attribute, the certificate and those after it inside. Fails if the certificate is not valid at
/// `now`.
Result<std::string> cms_sign(const StationKeys& keys, std::string_view message, UtcTime now);

struct CmsSigner {
  std::string name;          ///< the certificate's subject, "CN = ST-01"
  std::string fingerprint;   ///< SHA-256 of the certificate in DER, hexadecimal
  std::string signing_time;  ///< UTC, ISO 8601, by the station's clock
  UtcTime signed_at;
};

/// Who signed: fails if it is no CMS signature of the message by the first certificate of
/// `certificate_pem`. Whether that certificate deserves trust is not looked at.
Result<CmsSigner> cms_verify(std::string_view der, std::string_view message,
                             std::string_view certificate_pem, std::string_view name);

/// Name and SHA-256 fingerprint of the first certificate; nothing if there is none.
std::optional<CmsSigner> certificate_owner(std::string_view certificate_pem);

}  // namespace skullstation
