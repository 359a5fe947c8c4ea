#include "core/result.h"

namespace skullstation {

std::string Error::message() const {
  std::string text = where.empty() ? what : where + ": " + what;
  if (!advice.empty()) text += "; " + advice;
  return text;
}

int exit_code(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return 2;
    case ErrorKind::bad_input: return 3;
    case ErrorKind::hardware: return 4;
    case ErrorKind::no_result: return 5;
    case ErrorKind::cancelled: return 130;
  }
  return 1;
}

const char* to_string(ErrorKind kind) {
  switch (kind) {
    case ErrorKind::usage: return "usage";
    case ErrorKind::bad_input: return "bad input";
    case ErrorKind::hardware: return "hardware";
    case ErrorKind::no_result: return "no result";
    case ErrorKind::cancelled: return "cancelled";
  }
  return "unknown";
}

}  // namespace skullstation
