#include "daemon/evidence/signature.h"

#include <fmt/format.h>
#include <openssl/pem.h>

#include "core/file.h"
#include "daemon/evidence/openssl_handles.h"

namespace skullstation {

namespace {

const unsigned char* octets(std::string_view bytes) {
  return reinterpret_cast<const unsigned char*>(bytes.data());
}

KeyHandle public_key(std::string_view pem) {
  const BioHandle bio = reading_from(pem);
  KeyHandle key(PEM_read_bio_PUBKEY(bio.get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  return key;
}

int digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  return -1;
}

}  // namespace

std::string ed25519_sign(const StationKeys& keys, std::string_view message) {
  const DigestContextHandle context(EVP_MD_CTX_new());
  std::string signature(64, '\0');
  std::size_t size = signature.size();
  // Neither can fail for an Ed25519 key, which read_station_keys() makes sure of.
  EVP_DigestSignInit(context.get(), nullptr, nullptr, nullptr, keys.ed25519.get());
  EVP_DigestSign(context.get(), reinterpret_cast<unsigned char*>(signature.data()), &size,
                 octets(message), message.size());
  return signature;
}

bool ed25519_verify(std::string_view public_pem, std::string_view message,
                    std::string_view signature) {
  const KeyHandle key = public_key(public_pem);
  if (!key || EVP_PKEY_get_base_id(key.get()) != EVP_PKEY_ED25519) return false;
  const DigestContextHandle context(EVP_MD_CTX_new());
  const bool valid =
      EVP_DigestVerifyInit(context.get(), nullptr, nullptr, nullptr, key.get()) == 1 &&
      EVP_DigestVerify(context.get(), octets(signature), signature.size(), octets(message),
                       message.size()) == 1;
  ERR_clear_error();
  return valid;
}

std::string public_key_fingerprint(std::string_view public_pem) {
  const KeyHandle key = public_key(public_pem);
  if (!key) return {};
  const BioHandle der = collecting();
  i2d_PUBKEY_bio(der.get(), key.get());
  return sha256_hex(collected(der));
}

std::string to_hex(std::string_view bytes) {
  std::string hex;
  hex.reserve(2 * bytes.size());
  for (const char byte : bytes) hex += fmt::format("{:02x}", static_cast<unsigned char>(byte));
  return hex;
}

Result<std::string> from_hex(std::string_view hex, std::string_view where) {
  std::string bytes;
  bytes.reserve(hex.size() / 2);
  for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
    const int high = digit(hex[i]);
    const int low = digit(hex[i + 1]);
    if (high < 0 || low < 0) break;
    bytes += static_cast<char>(16 * high + low);
  }
  if (2 * bytes.size() == hex.size()) return bytes;
  return fail(ErrorKind::bad_input, std::string(where), "is not lower-case hexadecimal");
}

}  // namespace skullstation
