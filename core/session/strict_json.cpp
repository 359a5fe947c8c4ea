#include "core/session/strict_json.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "core/nearest_word.h"

namespace skullstation {

using nlohmann::json;

namespace {

std::string line_and_column(std::string_view text, std::size_t byte) {
  const std::string_view before = text.substr(0, std::min(byte, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0: the first line
  return fmt::format("line {}, column {}", line, before.size() - line_start);
}

/// "[json.exception.parse_error.101] parse error at line 1, column 2: syntax error …" without
/// what a reader of the file has no use for.
std::string without_library_words(std::string message) {
  if (const auto bracket = message.find("] "); bracket != std::string::npos) {
    message.erase(0, bracket + 2);
  }
  if (message.starts_with("parse error")) {
    if (const auto colon = message.find(": "); colon != std::string::npos) {
      message.erase(0, colon + 2);
    }
  }
  return message;
}

std::string suggestion(std::string_view key, const std::vector<std::string>& known) {
  constexpr std::size_t longest = 64;  // a longer key is no typing error
  const std::string nearest = key.size() <= longest ? nearest_word(key, known) : "";
  return nearest.empty() ? "remove it, or begin it with \"x_\" if it is a note of your own"
                         : fmt::format("did you mean \"{}\"?", nearest);
}

/// Short enough for an error message.
std::string described(const json& value) {
  return value.is_primitive() ? value.dump().substr(0, 40) : value.type_name();
}

}  // namespace

Result<json> parse_strict_json(std::string_view text, std::string_view name) {
  std::vector<std::set<std::string>> keys_by_depth;
  std::optional<std::string> repeated;
  const auto watch = [&](int, json::parse_event_t event, json& parsed) {
    if (event == json::parse_event_t::object_start) {
      keys_by_depth.emplace_back();
    } else if (event == json::parse_event_t::object_end) {
      keys_by_depth.pop_back();
    } else if (event == json::parse_event_t::key &&
               !keys_by_depth.back().insert(parsed.get<std::string>()).second && !repeated) {
      repeated = parsed.get<std::string>();
    }
    return true;
  };
  try {
    json document = json::parse(text, watch);
    if (repeated) {
      return fail(ErrorKind::bad_input, std::string(name),
                  fmt::format("has the key \"{}\" twice in one object", *repeated),
                  "remove one of them");
    }
    return document;
  } catch (const json::parse_error& error) {
    return fail(ErrorKind::bad_input,
                fmt::format("{}: {}", name, line_and_column(text, error.byte)),
                fmt::format("is not valid JSON: {}", without_library_words(error.what())));
  } catch (const json::exception& error) {  // a number beyond the range of double
    return fail(ErrorKind::bad_input, std::string(name),
                fmt::format("is not valid JSON: {}", without_library_words(error.what())));
  }
}

void JsonFaults::report(const std::string& path, std::string what, std::string advice) {
  if (first_) return;
  first_ = Error{ErrorKind::bad_input, path.empty() ? file_ : file_ + ": " + path, std::move(what),
                 std::move(advice)};
}

JsonObject::JsonObject(const json& value, std::string path, JsonFaults& faults)
    : value_(value.is_object() ? &value : nullptr), path_(std::move(path)), faults_(faults) {
  if (value_ == nullptr) {
    faults_.report(path_, fmt::format("must be an object, not {}", value.type_name()));
  }
}

std::string JsonObject::path(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

void JsonObject::fault(std::string_view key, std::string what, std::string advice) {
  faults_.report(path(key), std::move(what), std::move(advice));
}

const json* JsonObject::find(std::string_view key) {
  known_.emplace_back(key);
  if (value_ == nullptr) return nullptr;
  const auto found = value_->find(key);
  return found == value_->end() || found->is_null() ? nullptr : &*found;
}

const json* JsonObject::require(std::string_view key) {
  const json* value = find(key);
  if (value == nullptr) fault(key, "is missing");
  return value;
}

std::optional<std::string> JsonObject::optional_text(std::string_view key) {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_string()) {
    fault(key, fmt::format("must be a string, not {}", described(*value)));
    return std::nullopt;
  }
  return value->get<std::string>();
}

std::string JsonObject::text(std::string_view key) {
  std::optional<std::string> value = optional_text(key);
  if (!value) fault(key, "is missing; a string was expected");
  return std::move(value).value_or(std::string{});
}

std::optional<double> JsonObject::optional_number(std::string_view key) {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number()) {
    fault(key, fmt::format("must be a number, not {}", described(*value)));
    return std::nullopt;
  }
  return value->get<double>();
}

double JsonObject::number(std::string_view key) {
  const std::optional<double> value = optional_number(key);
  if (!value) fault(key, "is missing; a number was expected");
  return value.value_or(0.0);
}

std::optional<std::int64_t> JsonObject::optional_integer(std::string_view key, std::int64_t low,
                                                         std::int64_t high) {
  const std::optional<double> value = optional_number(key);
  if (!value) return std::nullopt;
  if (std::floor(*value) != *value || *value < static_cast<double>(low) ||
      *value > static_cast<double>(high)) {
    fault(key, fmt::format("must be a whole number from {} to {}, not {}", low, high, *value));
    return std::nullopt;
  }
  return static_cast<std::int64_t>(*value);
}

int JsonObject::integer(std::string_view key, int low, int high) {
  const std::optional<std::int64_t> value = optional_integer(key, low, high);
  if (!value) fault(key, "is missing; a whole number was expected");
  return static_cast<int>(value.value_or(low));
}

std::optional<bool> JsonObject::optional_flag(std::string_view key) {
  const json* value = find(key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_boolean()) {
    fault(key, fmt::format("must be true or false, not {}", described(*value)));
    return std::nullopt;
  }
  return value->get<bool>();
}

std::vector<double> JsonObject::numbers(std::string_view key, const json& value) {
  std::vector<double> result;
  if (!value.is_array()) {
    fault(key, "must be an array of numbers");
    return result;
  }
  for (std::size_t i = 0; i < value.size(); ++i) {
    if (!value[i].is_number()) {
      fault(fmt::format("{}[{}]", key, i),
            fmt::format("must be a number, not {}", described(value[i])));
      return {};
    }
    result.push_back(value[i].get<double>());
  }
  return result;
}

void JsonObject::finish() {
  if (value_ == nullptr) return;
  for (const auto& [key, ignored] : value_->items()) {
    if (key.starts_with("x_") || std::ranges::find(known_, key) != known_.end()) continue;
    fault(key, "is an unknown key", suggestion(key, known_));
  }
}

}  // namespace skullstation
