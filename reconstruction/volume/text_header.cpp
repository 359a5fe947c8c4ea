#include "reconstruction/volume/text_header.h"

#include <fstream>

#include "reconstruction/io/text_lines.h"

namespace skullstation {

std::string TextHeader::value(const std::string& name) const {
  const auto entry = fields.find(name);
  return entry == fields.end() ? std::string() : entry->second;
}

std::string TextHeader::first_word(const std::string& name) const {
  const std::string text = value(name);
  const auto words = words_of(text);
  return words.empty() ? std::string() : std::string(words[0]);
}

TextHeader read_text_header(const std::filesystem::path& path, char separator) {
  std::ifstream in(path, std::ios::binary);
  std::string text(65536, '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(in.gcount()));
  TextHeader header;
  TextLines lines(text);
  std::string_view line;
  while (lines.next(line)) {
    header.size += line.size() + 1;
    if (line.find_first_not_of(" \r") == std::string_view::npos) break;
    const std::size_t at = line.find(separator);
    if (at == std::string_view::npos) continue;
    std::string name(line.substr(0, at));
    name.erase(name.find_last_not_of(' ') + 1);
    header.fields[name] = std::string(line.substr(at + 1));
    if (name == "ElementDataFile") break;
  }
  return header;
}

}  // namespace skullstation
