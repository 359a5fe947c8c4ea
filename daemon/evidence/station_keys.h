#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <string>

#include "core/clock.h"
#include "core/result.h"

struct evp_pkey_st;  // OpenSSL's EVP_PKEY

namespace skullstation {

/// What a station signs with. Two keys, since each is the better one for somebody: Ed25519 is
/// short, deterministic and signs packages and the audit log; P-256 with an X.509 certificate is
/// what institutions' own software (CMS) and authorities know.
struct StationKeys {
  std::shared_ptr<evp_pkey_st> ed25519;
  std::string ed25519_public_pem;
  std::shared_ptr<evp_pkey_st> p256;
  std::string certificate_pem;  ///< of the P-256 key; authorities between may follow it
};

struct NewStationKeys {
  std::string station;  ///< the certificate's name (CN)
  int valid_days = 3650;
};

/// Makes a folder of new keys: ed25519.key, ed25519.pub.pem, p256.key, certificate.pem
/// (self-signed). The .key files are for this user alone (0600). Fails with `usage` where the
/// folder is there already.
Result<void> create_station_keys(const std::filesystem::path& folder, const NewStationKeys& wanted,
                                 const Clock& clock);

/// Reads such a folder. Fails if a private key can be read or written by others, is encrypted, or
/// does not belong to its public half.
Result<StationKeys> read_station_keys(const std::filesystem::path& folder);

}  // namespace skullstation
