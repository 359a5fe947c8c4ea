#pragma once

#include <filesystem>
#include <map>
#include <string>

namespace skullstation {

/// The "name: value" or "name = value" lines at the head of an NRRD or MetaImage file.
struct TextHeader {
  std::map<std::string, std::string> fields;
  std::size_t size = 0;  ///< bytes up to the end of the last line read

  /// Empty if the field is absent.
  std::string value(const std::string& name) const;
  std::string first_word(const std::string& name) const;
};

/// Reads up to an empty line or the line that names the data file, 64 KiB at most. An unreadable
/// file gives no fields.
TextHeader read_text_header(const std::filesystem::path& path, char separator);

}  // namespace skullstation
