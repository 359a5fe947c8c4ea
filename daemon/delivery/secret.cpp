#include "daemon/delivery/secret.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <utility>

#include "core/file.h"
#include "core/file_descriptor.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

Result<fs::path> file_of(const std::string& where) {
  if (where.starts_with('/')) return fs::path(where);
  if (where.find('/') != std::string::npos || where.starts_with('.')) {
    return fail(ErrorKind::bad_input, "secret " + where,
                "is neither an absolute path nor the name of a systemd credential");
  }
  const char* folder = std::getenv("CREDENTIALS_DIRECTORY");
  if (folder == nullptr) {
    return fail(ErrorKind::bad_input, "secret " + where,
                "is a systemd credential, and this program was not started with any",
                fmt::format("add LoadCredential={}:FILE to the unit, or name a file", where));
  }
  return fs::path(folder) / where;
}

}  // namespace

// Copied and wiped, not moved: a short string's bytes would stay behind.
Secret::Secret(Secret&& other) noexcept {
  text_ = other.text_;
  other.wipe();
}

Secret& Secret::operator=(Secret&& other) noexcept {
  if (this != &other) {
    wipe();
    text_ = other.text_;
    other.wipe();
  }
  return *this;
}

void Secret::wipe() {
  OPENSSL_cleanse(text_.data(), text_.size());
  text_.clear();
}

Result<void> check_secret_file(const fs::path& file) {
  struct stat status {};
  if (::stat(file.c_str(), &status) != 0) return read_error(file, errno);
  if (!S_ISREG(status.st_mode)) {
    return fail(ErrorKind::bad_input, file.string(), "is no file; a secret was expected");
  }
  // systemd gives credentials to a service's user through an access list, seen as group bits.
  const char* credentials = std::getenv("CREDENTIALS_DIRECTORY");
  const bool from_systemd = credentials != nullptr && file.parent_path() == credentials;
  const mode_t others = from_systemd ? 0037 : 0077;
  if ((status.st_mode & others) != 0) {
    return fail(
        ErrorKind::bad_input, file.string(),
        fmt::format("is a secret that others may read or write (mode {:o})", status.st_mode & 0777),
        fmt::format("take it as known to others and make a new one, or, if nobody else "
                    "was on this machine, `chmod 600 {}`",
                    file.string()));
  }
  if (status.st_uid != 0 && status.st_uid != ::geteuid()) {
    return fail(ErrorKind::bad_input, file.string(), "is a secret that belongs to another user",
                "it must belong to root or to the user of this program");
  }
  // Not PR_SET_DUMPABLE: it would give /proc/self to root, and steps need theirs.
  const rlimit none{0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  return {};
}

Result<Secret> read_secret(const std::string& where) {
  const auto file = file_of(where);
  if (!file) return forward(file);
  if (const auto safe = check_secret_file(*file); !safe) return forward(safe);
  auto text = read_file(*file);
  if (!text) return forward(text);
  while (text->ends_with('\n') || text->ends_with('\r')) text->pop_back();
  const bool sound =
      !text->empty() && text->find_first_of(std::string("\r\n\0", 3)) == std::string::npos;
  Secret secret(*text);
  OPENSSL_cleanse(&(*text)[0], text->size());
  if (!sound) {
    return fail(ErrorKind::bad_input, file->string(), "must hold a secret in one line");
  }
  return secret;
}

}  // namespace skullstation
