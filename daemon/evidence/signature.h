#pragma once

#include <string>
#include <string_view>

#include "core/result.h"
#include "daemon/evidence/station_keys.h"

namespace skullstation {

/// Detached Ed25519 signature (RFC 8032): 64 bytes, the same for the same message and key.
std::string ed25519_sign(const StationKeys& keys, std::string_view message);

/// Is it the signature of the message by the key? False for a key that is not Ed25519, too.
bool ed25519_verify(std::string_view public_pem, std::string_view message,
                    std::string_view signature);

/// SHA-256 of the key in DER (SubjectPublicKeyInfo), in hexadecimal; empty if it is no public key.
std::string public_key_fingerprint(std::string_view public_pem);

std::string to_hex(std::string_view bytes);
/// Lower-case hexadecimal to bytes; fails for anything else.
Result<std::string> from_hex(std::string_view hex, std::string_view where);

}  // namespace skullstation
