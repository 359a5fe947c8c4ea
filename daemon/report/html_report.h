#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/image.h"

namespace skullstation {

/// A mean with its standard deviation, beside another.
struct ErrorBars {
  struct Bar {
    double mean = 0.0;
    double sd = 0.0;
  };
  std::string name;
  Bar ours;
  Bar reference;
};

/// An HTML page in one file, pictures and all, that any browser shows and prints without a network.
/// Everything given is text: what HTML would take for its own is escaped.
class HtmlReport {
 public:
  explicit HtmlReport(std::string_view title);

  void add_heading(std::string_view text);
  void add_paragraph(std::string_view text);
  /// A paragraph that stands out: its first words, then the sentence.
  void add_warning(std::string_view name, std::string_view text);
  /// Two columns: what, and its value.
  void add_table(const std::vector<std::pair<std::string, std::string>>& rows);
  /// A chart with a row for each name: ours filled, the reference open, both with a line of one
  /// standard deviation either way.
  void add_error_bars(const std::vector<ErrorBars>& rows, std::string_view unit,
                      std::string_view ours, std::string_view reference);
  /// Pictures in a row that breaks where the page ends, each with its caption.
  void add_pictures(const std::vector<std::pair<std::string, Image8>>& pictures);

  std::string page() const;

 private:
  std::string title_;
  std::string body_;
};

/// RFC 4648, with padding.
std::string base64(std::string_view bytes);

}  // namespace skullstation
