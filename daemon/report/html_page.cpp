#include "daemon/report/html_page.h"

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
    "vertical-align:top;overflow-wrap:anywhere}td:first-child{color:#555}svg{max-width:100%}"
    ".warning{background:#fff4d6;border-left:5px solid #e0a000;padding:.5em 1em;margin:.5em 0}"
    ".pictures{display:flex;flex-wrap:wrap;gap:12px}figure{margin:0;flex:1 1 240px;max-width:380px;"
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

std::string html_of(const Heading& heading) {
  return fmt::format("<h2>{}</h2>\n", escaped(heading.text));
}

std::string html_of(const Paragraph& paragraph) {
  return fmt::format("<p>{}</p>\n", escaped(paragraph.text));
}

std::string html_of(const Warning& warning) {
  return fmt::format("<p class=\"warning\"><b>{}</b>: {}</p>\n", escaped(warning.name),
                     escaped(warning.text));
}

std::string html_of(const Table& table) {
  std::string html = "<table>\n";
  for (const auto& [what, value] : table.rows) {
    html += fmt::format("<tr><td>{}</td><td>{}</td></tr>\n", escaped(what), escaped(value));
  }
  return html + "</table>\n";
}

std::string html_of(const Pictures& pictures) {
  std::string html = "<div class=\"pictures\">\n";
  for (const auto& [caption, picture] : pictures.pictures) {
    html += fmt::format(
        "<figure><img alt=\"{0}\" src=\"data:image/jpeg;base64,{1}\">"
        "<figcaption>{0}</figcaption></figure>\n",
        escaped(caption), base64(encode_jpeg(picture, jpeg_quality)));
  }
  return html + "</div>\n";
}

std::string html_of(const ErrorBars& chart) {
  std::string html;
  constexpr double left = 110.0, width = 560.0, row_height = 22.0, top = 26.0;
  double most = 1.0;
  for (const ErrorBars::Row& row : chart.rows) {
    most = std::max({most, row.ours.mean + row.ours.sd, row.reference.mean + row.reference.sd});
  }
  const auto x_of = [&](double value) { return left + std::max(0.0, value) / most * width; };
  const double height = top + row_height * static_cast<double>(chart.rows.size()) + 20.0;
  html += fmt::format(
      "<svg viewBox=\"0 0 700 {:.0f}\" role=\"img\" style=\"max-width:900px;font-size:11px\">\n"
      "<text x=\"{:.0f}\" y=\"12\">&#9679; {} &#160; &#9675; {} [{}]</text>\n",
      height, left, escaped(chart.ours), escaped(chart.reference), escaped(chart.unit));
  for (int tick = 0; tick <= most; tick += 5) {
    html += fmt::format(
        "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.0f}\" y2=\"{2:.0f}\" stroke=\"#ddd\"/>"
        "<text x=\"{0:.1f}\" y=\"{3:.0f}\" text-anchor=\"middle\">{4}</text>\n",
        x_of(tick), top, height - 18.0, height - 6.0, tick);
  }
  for (std::size_t i = 0; i < chart.rows.size(); ++i) {
    const double y = top + row_height * (static_cast<double>(i) + 0.5);
    html += fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n",
                        left - 8.0, y + 4.0, escaped(chart.rows[i].name));
    const auto add_bar = [&](const ErrorBars::Bar& bar, double at, const char* fill) {
      html += fmt::format(
          "<line x1=\"{:.1f}\" x2=\"{:.1f}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#225\"/>"
          "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3.5\" fill=\"{}\" stroke=\"#225\"/>\n",
          x_of(bar.mean - bar.sd), x_of(bar.mean + bar.sd), at, at, x_of(bar.mean), at, fill);
    };
    add_bar(chart.rows[i].ours, y - 4.0, "#225");
    add_bar(chart.rows[i].reference, y + 4.0, "#fff");
  }
  return html + "</svg>\n";
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

std::string html_page(const Report& report) {
  std::string body;
  for (const ReportBlock& block : report.blocks) {
    body += std::visit([](const auto& b) { return html_of(b); }, block);
  }
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width\"><title>{0}</title>"
      "<style>{1}</style></head>\n<body>\n<h1>{0}</h1>\n{2}</body></html>\n",
      escaped(report.title), style, body);
}

}  // namespace skullstation
