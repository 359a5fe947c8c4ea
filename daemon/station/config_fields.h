#pragma once

#include <chrono>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace skullstation {

/// One walk over every key of a configuration. The same walk (visit_config in station_config.cpp)
/// reads a file, checks it and shows the values in force, so that a key, its meaning and its
/// default stand in one place only.
class ConfigFields {
 public:
  virtual ~ConfigFields() = default;

  virtual void field(std::string_view key, bool& value, std::string_view meaning) = 0;
  virtual void field(std::string_view key, int& value, std::string_view meaning) = 0;
  virtual void field(std::string_view key, double& value, std::string_view meaning) = 0;
  virtual void field(std::string_view key, std::string& value, std::string_view meaning) = 0;
  /// One of a few words; `value` is the index of the word.
  virtual void choice(std::string_view key, int& value, const std::vector<std::string>& words,
                      std::string_view meaning) = 0;
  /// True if an optional key should be visited: it stands in the file, or is set and to be shown.
  virtual bool present(std::string_view key, bool is_set, std::string_view meaning) = 0;

  /// A [table].
  virtual void table(std::string_view key, const std::function<void()>& content) = 0;
  /// An [[array of tables]] of `count` entries before the walk; `resize` makes room, `content`
  /// visits one entry.
  virtual void tables(std::string_view key, std::size_t count,
                      const std::function<void(std::size_t)>& resize,
                      const std::function<void(std::size_t)>& content) = 0;

  // What follows is made of the above.

  template <class T>
  void field(std::string_view key, std::optional<T>& value, std::string_view meaning) {
    if (!present(key, value.has_value(), meaning)) return;
    if (!value) value.emplace();
    field(key, *value, meaning);
  }

  template <class Rep, class Period>
  void field(std::string_view key, std::chrono::duration<Rep, Period>& value,
             std::string_view meaning) {
    int count = static_cast<int>(value.count());
    field(key, count, meaning);
    value = std::chrono::duration<Rep, Period>(count);
  }

  template <class Enum>
  requires std::is_enum_v<Enum>
  void field(std::string_view key, Enum& value, const std::vector<std::string>& words,
             std::string_view meaning) {
    int index = static_cast<int>(value);
    choice(key, index, words, meaning);
    value = static_cast<Enum>(index);
  }
};

}  // namespace skullstation
