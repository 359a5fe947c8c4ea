#include "reconstruction/volume/dicom_elements.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "reconstruction/io/byte_order.h"
#include "reconstruction/io/text_lines.h"

namespace skullstation {

namespace {

constexpr std::uint32_t undefined_length = 0xffffffff;
constexpr DicomTag item_tag = 0xfffee000;
constexpr DicomTag item_end_tag = 0xfffee00d;
constexpr DicomTag sequence_end_tag = 0xfffee0dd;
constexpr int deepest_sequence = 16;

/// Value representations whose length takes 4 bytes after 2 reserved ones (PS3.5 table 7.1-1).
constexpr std::array<std::string_view, 13> long_types = {"OB", "OD", "OF", "OL", "OV", "OW", "SQ",
                                                         "SV", "UC", "UN", "UR", "UT", "UV"};

std::string_view without_padding(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  text.remove_prefix(begin);
  return text.substr(0, text.find_last_not_of(std::string_view(" \0", 2)) + 1);
}

}  // namespace

// ----------------------------------------------------------------------------------- data set --

const DicomDataSet::Element* DicomDataSet::find(DicomTag tag) const {
  const auto found = std::ranges::find(elements_, tag, &Element::tag);
  return found == elements_.end() ? nullptr : &*found;
}

std::string DicomDataSet::text(DicomTag tag) const {
  const Element* element = find(tag);
  return element ? std::string(without_padding(element->value)) : std::string();
}

std::optional<std::vector<double>> DicomDataSet::decimals(DicomTag tag, std::size_t count) const {
  std::string all = text(tag);
  std::ranges::replace(all, '\\', ' ');
  std::vector<double> numbers;
  for (const std::string_view word : words_of(all)) {
    double number = 0.0;
    if (!parse_number(word, number) || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

std::optional<double> DicomDataSet::decimal(DicomTag tag) const {
  const auto numbers = decimals(tag, 1);
  return numbers ? std::optional((*numbers)[0]) : std::nullopt;
}

std::optional<int> DicomDataSet::number(DicomTag tag) const {
  const Element* element = find(tag);
  if (element == nullptr || element->value.size() != 2) return std::nullopt;
  return load_number<std::uint16_t>(element->value.data(), std::endian::little);
}

const std::vector<DicomDataSet>& DicomDataSet::items(DicomTag tag) const {
  static const std::vector<DicomDataSet> none;
  const Element* element = find(tag);
  return element ? element->items : none;
}

std::optional<std::string_view> DicomDataSet::bytes(DicomTag tag) const {
  const Element* element = find(tag);
  return element ? std::optional(element->value) : std::nullopt;
}

// ------------------------------------------------------------------------------------- parser --

/// Walks through the bytes of one file.
class DicomParser {
 public:
  DicomParser(std::string_view bytes, std::string_view name) : bytes_(bytes), name_(name) {}

  Result<DicomFile> parse() {
    DicomFile file;
    position_ = 132;
    const auto meta = parse_meta();
    if (!meta) return forward(meta);
    file.transfer_syntax_uid = meta->text(0x00020010);
    const std::string& syntax = file.transfer_syntax_uid;
    if (syntax.empty()) return bad("the file meta information names no transfer syntax");
    if (syntax == "1.2.840.10008.1.2.2" || syntax == "1.2.840.10008.1.2.1.99") {
      return bad("big endian and deflated files are not read");
    }
    const bool explicit_types = syntax != "1.2.840.10008.1.2";
    auto data = parse_data_set(bytes_.size(), explicit_types, 0, nullptr);
    if (!data) return forward(data);
    file.data = std::move(*data);
    file.encapsulated_pixels = encapsulated_;
    return file;
  }

 private:
  struct ElementStart {
    DicomTag tag = 0;
    std::uint32_t length = 0;
    bool is_sequence = false;
    bool is_unknown = false;  // UN: what is inside has implicit types (PS3.5 section 6.2.2)
  };

  tl::unexpected<Error> bad(std::string what) const {
    return bad_file(name_, fmt::format("byte {}", position_), std::move(what));
  }

  std::size_t remaining(std::size_t end) const { return end - position_; }

  DicomTag peek_tag() const {
    const auto group = load_number<std::uint16_t>(bytes_.data() + position_, std::endian::little);
    const auto element =
        load_number<std::uint16_t>(bytes_.data() + position_ + 2, std::endian::little);
    return (DicomTag{group} << 16) | element;
  }

  /// Group 2, always with explicit types; its end is where another group begins.
  Result<DicomDataSet> parse_meta() {
    DicomDataSet meta;
    while (position_ + 8 <= bytes_.size() && peek_tag() >> 16 == 0x0002) {
      const auto start = parse_start(bytes_.size(), true);
      if (!start) return forward(start);
      if (start->length > remaining(bytes_.size())) return bad("the file is truncated");
      meta.elements_.push_back({start->tag, bytes_.substr(position_, start->length), {}});
      position_ += start->length;
    }
    return meta;
  }

  Result<ElementStart> parse_start(std::size_t end, bool explicit_types) {
    if (remaining(end) < 8) return bad("the file is truncated within an element");
    ElementStart start;
    start.tag = peek_tag();
    const char* at = bytes_.data() + position_;
    const bool delimiter = start.tag >> 16 == 0xfffe;
    if (!explicit_types || delimiter) {
      start.length = load_number<std::uint32_t>(at + 4, std::endian::little);
      position_ += 8;
      // Without types a sequence shows by its undefined length or by its first item.
      start.is_sequence = !delimiter && (start.length == undefined_length || next_is_item(end));
      return start;
    }
    const std::string_view type(at + 4, 2);
    if (std::ranges::find(long_types, type) == long_types.end()) {
      if (type[0] < 'A' || type[0] > 'Z' || type[1] < 'A' || type[1] > 'Z') {
        return bad("an element has no value representation");
      }
      start.length = load_number<std::uint16_t>(at + 6, std::endian::little);
      position_ += 8;
      return start;
    }
    if (remaining(end) < 12) return bad("the file is truncated within an element");
    start.length = load_number<std::uint32_t>(at + 8, std::endian::little);
    position_ += 12;
    start.is_unknown = type == "UN";
    start.is_sequence = type == "SQ" || start.length == undefined_length;
    return start;
  }

  bool next_is_item(std::size_t end) const { return remaining(end) >= 8 && peek_tag() == item_tag; }

  /// Elements up to `end`, or up to the item's end if `ended` is given (its length is undefined).
  Result<DicomDataSet> parse_data_set(std::size_t end, bool explicit_types, int depth,
                                      bool* ended) {
    if (depth > deepest_sequence) return bad("sequences are nested too deeply");
    DicomDataSet data;
    while (position_ < end) {
      const std::size_t element_at = position_;
      const auto start = parse_start(end, explicit_types);
      if (!start) return forward(start);
      if (start->tag == item_end_tag && ended != nullptr) {
        *ended = true;
        return data;
      }
      if (start->tag >> 16 == 0xfffe) {
        position_ = element_at;
        return bad("an item's delimiter stands where an element is due");
      }
      const bool defined = start->length != undefined_length;
      if (defined && start->length > remaining(end)) {
        position_ = element_at;
        return bad(fmt::format("element ({:04x},{:04x}) claims {} bytes, {} are left",
                               start->tag >> 16, start->tag & 0xffff, start->length,
                               remaining(end)));
      }
      DicomDataSet::Element element{start->tag, {}, {}};
      const std::size_t value_at = position_;
      const std::size_t value_end = defined ? position_ + start->length : end;
      if (start->tag == DicomFile::pixel_data && !defined) {
        encapsulated_ = encapsulated_ || depth == 0;
        if (const auto skipped = skip_fragments(end); !skipped) return forward(skipped);
      } else if (start->is_sequence) {
        auto items = parse_items(value_end, defined, explicit_types && !start->is_unknown, depth);
        if (!items) return forward(items);
        element.items = std::move(*items);
      } else {
        position_ = value_end;
      }
      element.value = bytes_.substr(value_at, position_ - value_at);
      data.elements_.push_back(std::move(element));
    }
    return data;
  }

  Result<std::vector<DicomDataSet>> parse_items(std::size_t end, bool defined, bool explicit_types,
                                                int depth) {
    std::vector<DicomDataSet> items;
    while (!defined || position_ < end) {
      if (remaining(end) < 8) return bad("the file is truncated within a sequence");
      const DicomTag tag = peek_tag();
      const auto length =
          load_number<std::uint32_t>(bytes_.data() + position_ + 4, std::endian::little);
      if (tag == sequence_end_tag && !defined) {
        position_ += 8;
        return items;
      }
      if (tag != item_tag) return bad("a sequence's item was expected");
      position_ += 8;
      const bool item_defined = length != undefined_length;
      if (item_defined && length > remaining(end))
        return bad("an item reaches beyond its sequence");
      bool ended = false;
      auto item = parse_data_set(item_defined ? position_ + length : end, explicit_types, depth + 1,
                                 item_defined ? nullptr : &ended);
      if (!item) return forward(item);
      if (!item_defined && !ended) return bad("an item has no end");
      items.push_back(std::move(*item));
    }
    return items;
  }

  Result<void> skip_fragments(std::size_t end) {
    while (remaining(end) >= 8) {
      const DicomTag tag = peek_tag();
      const auto length =
          load_number<std::uint32_t>(bytes_.data() + position_ + 4, std::endian::little);
      if (tag != item_tag && tag != sequence_end_tag) return bad("a pixel fragment was expected");
      if (length > remaining(end) - 8) return bad("a pixel fragment reaches beyond the file");
      position_ += 8 + length;
      if (tag == sequence_end_tag) return {};
    }
    return bad("the file is truncated within its pixel fragments");
  }

  std::string_view bytes_;
  std::string_view name_;
  std::size_t position_ = 0;
  bool encapsulated_ = false;
};

bool has_dicom_preamble(std::string_view bytes) {
  return bytes.size() >= 132 && bytes.substr(128, 4) == "DICM";
}

Result<DicomFile> parse_dicom(std::string_view bytes, std::string_view name) {
  if (!has_dicom_preamble(bytes)) {
    return bad_file(name, "byte 128", "\"DICM\" is missing: not a DICOM file");
  }
  return DicomParser(bytes, name).parse();
}

}  // namespace skullstation
