#pragma once

#include <cstdint>
#include <string>

namespace skullstation {

/// What one look at a password costs: Argon2id with RFC 9106's second choice, on one lane, since a
/// station has few cores. Tests take less.
struct PasswordCost {
  std::uint32_t memory_kib = 65536;
  std::uint32_t passes = 3;
};

/// What is kept of a password, in Argon2's own words: "$argon2id$v=19$m=65536,t=3,p=1$…". Empty if
/// there is not enough memory.
std::string hash_password(const std::string& password, const PasswordCost& cost);

bool is_password(const std::string& password, const std::string& hash);

/// So many random bytes of the kernel's, as hexadecimal digits.
std::string random_hex(int bytes);

/// Twelve letters and digits that nobody mistakes for others: "K7QD-M2XW-9RTA".
std::string random_code();

}  // namespace skullstation
