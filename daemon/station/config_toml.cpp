#include "daemon/station/config_toml.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <toml.hpp>

#include "core/file.h"
#include "core/nearest_word.h"

namespace skullstation {

namespace {

std::string joined(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : fmt::format("{}.{}", path, key);
}

std::string type_name(const toml::value& value) {
  if (value.is_boolean()) return "true/false";
  if (value.is_integer()) return "a whole number";
  if (value.is_floating()) return "a number";
  if (value.is_string()) return "text";
  if (value.is_array()) return "a list";
  if (value.is_table()) return "a table";
  return "a date";
}

class Reader final : public ConfigFields {
 public:
  Reader(const toml::value& root, std::string file, TomlReading& reading)
      : file_(std::move(file)), reading_(reading) {
    open_.push_back({&root, "", {}});
  }

  ~Reader() override = default;

  /// To be called after the walk: complains about keys of the top level that nobody asked for.
  void finish() { report_unknown(); }

  void field(std::string_view key, bool& value, std::string_view) override {
    if (const toml::value* found = take(key)) {
      if (found->is_boolean()) {
        value = found->as_boolean();
      } else {
        wrong_type(key, *found, "true or false");
      }
    }
  }

  void field(std::string_view key, int& value, std::string_view) override {
    if (const toml::value* found = take(key)) {
      if (found->is_integer() && found->as_integer() >= INT32_MIN &&
          found->as_integer() <= INT32_MAX) {
        value = static_cast<int>(found->as_integer());
      } else {
        wrong_type(key, *found, "a whole number");
      }
    }
  }

  void field(std::string_view key, double& value, std::string_view) override {
    if (const toml::value* found = take(key)) {
      if (found->is_floating()) {
        value = found->as_floating();
      } else if (found->is_integer()) {
        value = static_cast<double>(found->as_integer());
      } else {
        wrong_type(key, *found, "a number");
      }
    }
  }

  void field(std::string_view key, std::string& value, std::string_view) override {
    if (const toml::value* found = take(key)) {
      if (found->is_string()) {
        value = found->as_string().str;
      } else {
        wrong_type(key, *found, "text in quotes");
      }
    }
  }

  void choice(std::string_view key, int& value, const std::vector<std::string>& words,
              std::string_view) override {
    const toml::value* found = take(key);
    if (found == nullptr) return;
    if (!found->is_string()) return wrong_type(key, *found, "text in quotes");
    const std::string& word = found->as_string().str;
    const auto match = std::find(words.begin(), words.end(), word);
    if (match != words.end()) {
      value = static_cast<int>(match - words.begin());
    } else {
      problem(*found, fmt::format("{} can't be \"{}\"", joined(open_.back().path, key), word),
              fmt::format("use one of: {}", fmt::join(words, ", ")));
    }
  }

  bool present(std::string_view key, bool, std::string_view) override {
    open_.back().known.emplace_back(key);
    return open_.back().table->contains(std::string(key));
  }

  void table(std::string_view key, const std::function<void()>& content) override {
    static const toml::value empty = toml::table{};
    const toml::value* found = take(key);
    if (found != nullptr && !found->is_table()) {
      wrong_type(key, *found, fmt::format("a table: [{}]", key));
      found = nullptr;
    }
    enter(found != nullptr ? *found : empty, joined(open_.back().path, key), content);
  }

  void tables(std::string_view key, std::size_t, const std::function<void(std::size_t)>& resize,
              const std::function<void(std::size_t)>& content) override {
    const toml::value* found = take(key);
    if (found == nullptr) return;
    if (!found->is_array()) {
      return wrong_type(key, *found, fmt::format("a list of tables: [[{}]]", key));
    }
    const auto& entries = found->as_array();
    resize(entries.size());
    for (std::size_t i = 0; i < entries.size(); ++i) {
      if (!entries[i].is_table()) {
        wrong_type(key, entries[i], fmt::format("a list of tables: [[{}]]", key));
        continue;
      }
      enter(entries[i], fmt::format("{}[{}]", joined(open_.back().path, key), i),
            [&] { content(i); });
    }
  }

 private:
  struct OpenTable {
    const toml::value* table;
    std::string path;
    std::vector<std::string> known;
  };

  void enter(const toml::value& value, std::string path, const std::function<void()>& content) {
    open_.push_back({&value, std::move(path), {}});
    content();
    report_unknown();
    open_.pop_back();
  }

  const toml::value* take(std::string_view key) {
    OpenTable& table = open_.back();
    table.known.emplace_back(key);
    const auto& entries = table.table->as_table();
    const auto found = entries.find(std::string(key));
    if (found == entries.end()) return nullptr;
    reading_.origins[joined(table.path, key)] = place(found->second);
    return &found->second;
  }

  void report_unknown() {
    const OpenTable& table = open_.back();
    std::map<int, std::string> unknown;  // by line, as the reader of the file meets them
    for (const auto& [key, value] : table.table->as_table()) {
      if (std::find(table.known.begin(), table.known.end(), key) == table.known.end()) {
        unknown[static_cast<int>(value.location().line())] = key;
      }
    }
    for (const auto& [line, key] : unknown) {
      const std::string near = nearest_word(key, table.known);
      problem(table.table->at(key), fmt::format("unknown key \"{}\"", joined(table.path, key)),
              near.empty() ? fmt::format("known keys here: {}", fmt::join(table.known, ", "))
                           : fmt::format("did you mean \"{}\"?", near));
    }
  }

  std::string place(const toml::value& value) const {
    return fmt::format("{}:{}", file_, value.location().line());
  }

  void problem(const toml::value& value, std::string what, std::string advice) {
    reading_.problems.push_back(
        {ErrorKind::bad_input, place(value), std::move(what), std::move(advice)});
  }

  void wrong_type(std::string_view key, const toml::value& found, const std::string& expected) {
    problem(found,
            fmt::format("{} must be {}, found {}", joined(open_.back().path, key), expected,
                        type_name(found)),
            "");
  }

  std::string file_;
  TomlReading& reading_;
  std::vector<OpenTable> open_;
};

/// Walks the values in force and hands each, with its path, to `leaf`.
class Shower : public ConfigFields {
 public:
  explicit Shower(const std::map<std::string, std::string>& origins) : origins_(origins) {}

  void field(std::string_view key, bool& value, std::string_view meaning) override {
    leaf(key, value, meaning);
  }
  void field(std::string_view key, int& value, std::string_view meaning) override {
    leaf(key, value, meaning);
  }
  void field(std::string_view key, double& value, std::string_view meaning) override {
    leaf(key, value, meaning);
  }
  void field(std::string_view key, std::string& value, std::string_view meaning) override {
    leaf(key, value, meaning);
  }
  void choice(std::string_view key, int& value, const std::vector<std::string>& words,
              std::string_view meaning) override {
    leaf(key, words[value], fmt::format("{} ({})", meaning, fmt::join(words, ", ")));
  }
  bool present(std::string_view key, bool is_set, std::string_view meaning) override {
    if (!is_set) unset(key, meaning);
    return is_set;
  }

 protected:
  virtual void leaf(std::string_view key, const nlohmann::json& value,
                    std::string_view meaning) = 0;
  virtual void unset(std::string_view, std::string_view) {}

  std::string origin(std::string_view key) const {
    const auto found = origins_.find(joined(path_, key));
    return found == origins_.end() ? "default" : found->second;
  }

  std::string path_;

 private:
  const std::map<std::string, std::string>& origins_;
};

class TomlShower final : public Shower {
 public:
  using Shower::Shower;
  std::string text;

  void table(std::string_view key, const std::function<void()>& content) override {
    section(fmt::format("[{}]", heading(key)), joined(path_, key), content);
  }

  void tables(std::string_view key, std::size_t count, const std::function<void(std::size_t)>&,
              const std::function<void(std::size_t)>& content) override {
    for (std::size_t i = 0; i < count; ++i) {
      section(fmt::format("[[{}]]", heading(key)), fmt::format("{}[{}]", joined(path_, key), i),
              [&] { content(i); });
    }
  }

 private:
  /// The path as a heading names it: within the last entry of an array, without its number.
  std::string heading(std::string_view key) const {
    std::string name = joined(path_, key);
    for (std::size_t open = name.find('['); open != std::string::npos; open = name.find('[')) {
      name.erase(open, name.find(']', open) - open + 1);
    }
    return name;
  }

  void section(const std::string& title, std::string path, const std::function<void()>& content) {
    text += fmt::format("{}{}\n", text.empty() ? "" : "\n", title);
    std::swap(path_, path);
    content();
    std::swap(path_, path);
  }

  void leaf(std::string_view key, const nlohmann::json& value, std::string_view meaning) override {
    text += fmt::format("{:<44} # {} [{}]\n", fmt::format("{} = {}", key, value.dump()), meaning,
                        origin(key));
  }

  void unset(std::string_view key, std::string_view meaning) override {
    text += fmt::format("{:<44} # {} [not set]\n", fmt::format("# {} =", key), meaning);
  }
};

class JsonShower final : public Shower {
 public:
  using Shower::Shower;
  nlohmann::ordered_json json = nlohmann::ordered_json::object();

  void table(std::string_view key, const std::function<void()>& content) override {
    section(joined(path_, key), content);
  }

  void tables(std::string_view key, std::size_t count, const std::function<void(std::size_t)>&,
              const std::function<void(std::size_t)>& content) override {
    for (std::size_t i = 0; i < count; ++i) {
      section(fmt::format("{}[{}]", joined(path_, key), i), [&] { content(i); });
    }
  }

 private:
  void section(std::string path, const std::function<void()>& content) {
    std::swap(path_, path);
    content();
    std::swap(path_, path);
  }

  void leaf(std::string_view key, const nlohmann::json& value, std::string_view) override {
    json[joined(path_, key)] = {{"value", value}, {"origin", origin(key)}};
  }
};

}  // namespace

TomlReading read_toml(const std::filesystem::path& file, const ConfigWalk& walk) {
  TomlReading reading;
  const auto bytes = read_file(file);
  if (!bytes) {
    reading.problems.push_back(bytes.error());
    return reading;
  }
  try {
    std::istringstream in(*bytes);
    const toml::value root = toml::parse(in, file.string());
    Reader reader(root, file.string(), reading);
    walk(reader);
    reader.finish();
  } catch (const toml::exception& error) {
    // The library's own message spans several lines; its first names the fault.
    std::string what = error.what();
    what = what.substr(0, what.find('\n'));
    reading.problems.push_back({ErrorKind::bad_input,
                                fmt::format("{}:{}", file.string(), error.location().line()),
                                fmt::format("not valid TOML ({})", what), ""});
  }
  return reading;
}

std::string show_toml(const ConfigWalk& walk, const std::map<std::string, std::string>& origins) {
  TomlShower shower(origins);
  walk(shower);
  return shower.text;
}

std::string show_json(const ConfigWalk& walk, const std::map<std::string, std::string>& origins) {
  JsonShower shower(origins);
  walk(shower);
  return shower.json.dump(2);
}

}  // namespace skullstation
