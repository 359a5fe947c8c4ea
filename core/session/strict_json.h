#pragma once

#include <concepts>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"

namespace skullstation {

/// Parses JSON (RFC 8259) without the usual laxness: a key given twice in one object is an error,
/// too. `name` stands for the file; errors give line and column.
Result<nlohmann::json> parse_strict_json(std::string_view text, std::string_view name);

/// The first thing found wrong with a JSON document. Readers go on with default values after it,
/// so that reading code stays linear; whoever started them looks here at the end.
class JsonFaults {
 public:
  explicit JsonFaults(std::string_view file) : file_(file) {}

  void report(const std::string& path, std::string what, std::string advice = {});
  const std::optional<Error>& first() const { return first_; }

 private:
  std::string file_;
  std::optional<Error> first_;
};

/// Reads one JSON object key by key. Keys that nobody asked for are errors in finish(), with the
/// nearest known key as the suggestion; keys that begin with "x_" are the writer's own. A null
/// counts as absent.
class JsonObject {
 public:
  /// `path` is the place in the document ("views[3]"; empty for the document itself).
  JsonObject(const nlohmann::json& value, std::string path, JsonFaults& faults);

  std::string path(std::string_view key) const;
  void fault(std::string_view key, std::string what, std::string advice = {});

  /// The value, or null if it is absent. Marks the key as known.
  const nlohmann::json* find(std::string_view key);
  /// The same; absent is a fault.
  const nlohmann::json* require(std::string_view key);

  std::string text(std::string_view key);
  std::optional<std::string> optional_text(std::string_view key);
  double number(std::string_view key);
  std::optional<double> optional_number(std::string_view key);
  /// A whole number within [low, high].
  std::optional<std::int64_t> optional_integer(std::string_view key, std::int64_t low,
                                               std::int64_t high);
  int integer(std::string_view key, int low, int high);
  std::optional<bool> optional_flag(std::string_view key);
  std::vector<double> numbers(std::string_view key, const nlohmann::json& value);

  /// Calls `read(element, path)` for each element of a required array.
  template <std::invocable<const nlohmann::json&, const std::string&> Read>
  void each(std::string_view key, const Read& read) {
    const nlohmann::json* array = require(key);
    if (array == nullptr) return;
    if (!array->is_array()) return fault(key, "must be an array");
    std::size_t index = 0;
    for (const nlohmann::json& element : *array) {
      read(element, path(key) + "[" + std::to_string(index++) + "]");
    }
  }

  void finish();

 private:
  const nlohmann::json* value_;  // null: not an object, already reported
  std::string path_;
  JsonFaults& faults_;
  std::vector<std::string> known_;
};

}  // namespace skullstation
