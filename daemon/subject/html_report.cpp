#include "daemon/subject/html_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>

#include "core/session/image_file.h"

namespace skullstation {

namespace {

constexpr int jpeg_quality = 88;

constexpr std::string_view style =
    "body{font:15px/1.5 system-ui,sans-serif;color:#222;max-width:1200px;margin:2em auto;"
    "padding:0 1.5em}h1{font-size:1.6em}h2{font-size:1.2em;margin-top:2em}"
    "table{border-collapse:collapse}td{padding:.25em 1.5em .25em 0;border-bottom:1px solid #ddd;"
    "vertical-align:top}td:first-child{color:#555}"
    ".warning{background:#fff4d6;border-left:5px solid #e0a000;padding:.5em 1em;margin:.5em 0}"
    ".pictures{display:flex;flex-wrap:wrap;gap:12px}figure{margin:0;flex:1 1 280px;max-width:380px;"
    "break-inside:avoid}img{width:100%;display:block}figcaption{font-size:.85em;color:#555}";

std::string escaped(std::string_view text) {
  std::string result;
  result.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&': result += "&amp;"; break;
      case '<': result += "&lt;"; break;
      case '>': result += "&gt;"; break;
      case '"': result += "&quot;"; break;
      default: result += c;
    }
  }
  return result;
}

}  // namespace

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t group = 0;
    for (std::size_t b = 0; b < 3; ++b) {
      group = group << 8 | (b < count ? static_cast<std::uint8_t>(bytes[i + b]) : 0U);
    }
    for (std::size_t d = 0; d < 4; ++d) {
      text += d <= count ? digits[group >> (18 - 6 * d) & 63U] : '=';
    }
  }
  return text;
}

HtmlReport::HtmlReport(std::string_view title) : title_(escaped(title)) {}

void HtmlReport::add_heading(std::string_view text) {
  body_ += fmt::format("<h2>{}</h2>\n", escaped(text));
}

void HtmlReport::add_paragraph(std::string_view text) {
  body_ += fmt::format("<p>{}</p>\n", escaped(text));
}

void HtmlReport::add_warning(std::string_view name, std::string_view text) {
  body_ += fmt::format("<p class=\"warning\"><b>{}</b>: {}</p>\n", escaped(name), escaped(text));
}

void HtmlReport::add_table(const std::vector<std::pair<std::string, std::string>>& rows) {
  body_ += "<table>\n";
  for (const auto& [what, value] : rows) {
    body_ += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped(what), escaped(value));
  }
  body_ += "</table>\n";
}

void HtmlReport::add_pictures(const std::vector<std::pair<std::string, Image8>>& pictures) {
  body_ += "<div class=\"pictures\">\n";
  for (const auto& [caption, picture] : pictures) {
    body_ += fmt::format(
        "<figure><img alt=\"{0}\" src=\"data:image/jpeg;base64,{1}\">"
        "<figcaption>{0}</figcaption></figure>\n",
        escaped(caption), base64(encode_jpeg(picture, jpeg_quality)));
  }
  body_ += "</div>\n";
}

std::string HtmlReport::page() const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>{0}</title>"
      "<style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      title_, style, body_);
}

}  // namespace skullstation
