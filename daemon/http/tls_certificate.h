#pragma once

#include <filesystem>
#include <string>

#include "core/clock.h"
#include "core/result.h"

namespace skullstation {

/// What the console shows browsers to be itself.
struct TlsCertificate {
  std::string chain_pem;
  std::string key_pem;
  std::string fingerprint;  ///< SHA-256 of the first certificate: "AB:CD:…", as browsers show it
};

/// The certificate that the station made for itself: folder/certificate.pem and folder/key.pem,
/// P-256, for localhost, this host's name and 127.0.0.1; made where there is none.
Result<TlsCertificate> own_certificate(const std::filesystem::path& folder, const Clock& clock);

/// An institution's own: a chain, the server's certificate first, and its key. Errors (bad_input):
/// can't be read, is no PEM, the key belongs to another certificate, the key may be read by others.
Result<TlsCertificate> read_certificate(const std::filesystem::path& chain,
                                        const std::filesystem::path& key);

}  // namespace skullstation
