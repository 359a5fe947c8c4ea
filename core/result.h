#pragma once

#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace skullstation {

/// What went wrong, in the terms a caller can act on. Each kind has one process exit code.
enum class ErrorKind {
  usage,      ///< the command line or an argument makes no sense (exit code 2)
  bad_input,  ///< a file, setting or image is not what it must be (3)
  hardware,   ///< a device is missing, busy, unplugged or stopped (4)
  no_result,  ///< the input is sound, yet a result of the required quality can't be reached (5)
  cancelled,  ///< the operator asked to stop (130)
};

/// An expected failure, told so that a person can mend it.
struct Error {
  ErrorKind kind = ErrorKind::bad_input;
  std::string where;   ///< file, device or setting, with the place in it: "station.toml:12"
  std::string what;    ///< what is wrong and what was expected
  std::string advice;  ///< what to do about it; may be empty

  /// One line: "where: what; advice".
  std::string message() const;
};

int exit_code(ErrorKind kind);

/// "usage", "bad input", "hardware", "no result", "cancelled".
const char* to_string(ErrorKind kind);

template <class T>
using Result = tl::expected<T, Error>;

/// `return fail(ErrorKind::hardware, "/dev/video0", "is used by another program", "close it");`
inline tl::unexpected<Error> fail(ErrorKind kind, std::string where, std::string what,
                                  std::string advice = {}) {
  return tl::unexpected<Error>(Error{kind, std::move(where), std::move(what), std::move(advice)});
}

/// Hands a failed result's error on: `if (!frame) return forward(frame);`
template <class T>
tl::unexpected<Error> forward(const tl::expected<T, Error>& failed) {
  return tl::unexpected<Error>(failed.error());
}

/// The same for what happened to a file's content, named before the place in it.
template <class T>
tl::unexpected<Error> forward(const std::string& file, const tl::expected<T, Error>& failed) {
  Error error = failed.error();
  error.where = file + ", " + error.where;
  return tl::unexpected<Error>(std::move(error));
}

}  // namespace skullstation
