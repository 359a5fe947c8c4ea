#pragma once

#include <filesystem>
#include <string>

#include "core/result.h"

namespace skullstation {

/// A password, token or key in memory. It can't be printed, is wiped at the end, and while one was
/// read the process leaves no core dump.
class Secret {
 public:
  Secret() = default;
  explicit Secret(std::string text) : text_(std::move(text)) {}
  ~Secret() { wipe(); }
  Secret(Secret&& other) noexcept;
  Secret& operator=(Secret&& other) noexcept;
  Secret(const Secret&) = delete;
  Secret& operator=(const Secret&) = delete;

  bool empty() const { return text_.empty(); }
  /// For the library that sends it.
  const char* reveal() const { return text_.c_str(); }

 private:
  void wipe();
  std::string text_;
};

/// Reads a secret: `where` is the name of a systemd credential (of $CREDENTIALS_DIRECTORY), or an
/// absolute path. An ending line feed is not part of it. Fails if somebody else than root and this
/// user owns the file or may read or write it, and if it is empty or holds line feeds.
Result<Secret> read_secret(const std::string& where);

/// The same checks for a file that a library reads by itself (a private key).
Result<void> check_secret_file(const std::filesystem::path& file);

}  // namespace skullstation
