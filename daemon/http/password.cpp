#include "daemon/http/password.h"

#include <argon2.h>
#include <fmt/format.h>
#include <sys/random.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <mutex>
#include <string_view>
#include <vector>

namespace skullstation {

namespace {

/// One at a time: each takes 64 MiB.
std::mutex& one_at_a_time() {
  static std::mutex mutex;
  return mutex;
}

void fill_randomly(unsigned char* bytes, std::size_t count) {
  for (std::size_t done = 0; done < count;) {
    const ssize_t got = ::getrandom(bytes + done, count - done, 0);
    if (got > 0) done += static_cast<std::size_t>(got);
    // The kernel has no random numbers: nothing that follows could be kept secret.
    if (got < 0 && errno != EINTR) std::abort();
  }
}

}  // namespace

std::string hash_password(const std::string& password, const PasswordCost& cost) {
  constexpr std::uint32_t lanes = 1;
  constexpr std::size_t hash_bytes = 32;
  std::array<unsigned char, 16> salt{};
  fill_randomly(salt.data(), salt.size());
  std::string text(
      argon2_encodedlen(cost.passes, cost.memory_kib, lanes, salt.size(), hash_bytes, Argon2_id),
      '\0');
  const std::lock_guard lock(one_at_a_time());
  const int status =
      argon2id_hash_encoded(cost.passes, cost.memory_kib, lanes, password.data(), password.size(),
                            salt.data(), salt.size(), hash_bytes, text.data(), text.size());
  if (status != ARGON2_OK) return {};
  text.resize(text.find('\0'));
  return text;
}

bool is_password(const std::string& password, const std::string& hash) {
  const std::lock_guard lock(one_at_a_time());
  return argon2id_verify(hash.c_str(), password.data(), password.size()) == ARGON2_OK;
}

std::string random_hex(int bytes) {
  std::vector<unsigned char> random(static_cast<std::size_t>(bytes));
  fill_randomly(random.data(), random.size());
  std::string text;
  for (const unsigned char byte : random) text += fmt::format("{:02x}", byte);
  return text;
}

std::string random_code() {
  constexpr std::string_view letters = "ABCDEFGHJKLMNPQRSTUVWXYZ23456789";  // 32: no bias
  static_assert(letters.size() == 32);
  std::array<unsigned char, 12> random{};
  fill_randomly(random.data(), random.size());
  std::string code;
  for (std::size_t i = 0; i < random.size(); ++i) {
    if (i > 0 && i % 4 == 0) code += '-';
    code += letters[random[i] % letters.size()];
  }
  return code;
}

}  // namespace skullstation
