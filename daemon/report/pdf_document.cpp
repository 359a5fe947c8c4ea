#include "daemon/report/pdf_document.h"

#include <fmt/format.h>
#include <hpdf.h>

#include <algorithm>
#include <memory>
#include <string_view>

#include "core/session/image_file.h"

namespace skullstation {

namespace {

constexpr int jpeg_quality = 88;
// Points, 72 to the inch.
constexpr float page_width = 595.0F;
constexpr float page_height = 842.0F;
constexpr float margin = 50.0F;
constexpr float text_width = page_width - 2.0F * margin;
constexpr float body_size = 9.5F;
constexpr float leading = 1.35F;
constexpr int pictures_in_row = 3;

/// UTF-8 as the fonts that every PDF reader has spell it.
std::string latin1(std::string_view utf8) {
  std::string text;
  for (std::size_t i = 0; i < utf8.size(); ++i) {
    const auto byte = static_cast<unsigned char>(utf8[i]);
    if (byte < 0x80) {
      text += utf8[i];
    } else if ((byte & 0xfc) == 0xc0 && i + 1 < utf8.size()) {
      text +=
          static_cast<char>((byte & 0x03) << 6 | (static_cast<unsigned char>(utf8[++i]) & 0x3f));
    } else {
      text += '?';
      while (i + 1 < utf8.size() && (static_cast<unsigned char>(utf8[i + 1]) & 0xc0) == 0x80) ++i;
    }
  }
  return text;
}

/// Lays blocks out on pages from top to bottom.
class PdfWriter {
 public:
  PdfWriter() : document_(HPDF_New(nullptr, nullptr), HPDF_Free) {
    HPDF_SetCompressionMode(document_.get(), HPDF_COMP_TEXT | HPDF_COMP_METADATA);
    regular_ = HPDF_GetFont(document_.get(), "Helvetica", "WinAnsiEncoding");
    bold_ = HPDF_GetFont(document_.get(), "Helvetica-Bold", "WinAnsiEncoding");
    add_page();
  }

  void add_title(const std::string& title) {
    HPDF_SetInfoAttr(document_.get(), HPDF_INFO_TITLE, latin1(title).c_str());
    add_text(title, bold_, 17.0F);
    y_ -= 6.0F;
  }

  void add(const Heading& heading) {
    make_room(60.0F);  // no heading at a page's foot
    y_ -= 10.0F;
    add_text(heading.text, bold_, 12.5F);
    y_ -= 2.0F;
  }

  void add(const Paragraph& paragraph) {
    add_text(paragraph.text, regular_, body_size);
    y_ -= 5.0F;
  }

  void add(const Warning& warning) {
    const float top = y_;
    const int page = pages_;
    add_text(warning.name + ": " + warning.text, regular_, body_size, margin + 10.0F,
             text_width - 10.0F);
    const float from = page == pages_ ? top : page_height - margin;
    HPDF_Page_SetRGBFill(page_, 0.88F, 0.63F, 0.0F);
    HPDF_Page_Rectangle(page_, margin, y_, 4.0F, from - y_);
    HPDF_Page_Fill(page_);
    HPDF_Page_SetGrayFill(page_, 0.0F);
    y_ -= 6.0F;
  }

  void add(const Table& table) {
    constexpr float first = 0.4F * text_width;
    for (const auto& [what, value] : table.rows) {
      const auto left = lines_of(what, regular_, body_size, first - 8.0F);
      const auto right = lines_of(value, regular_, body_size, text_width - first);
      const float height =
          body_size * leading * static_cast<float>(std::max(left.size(), right.size()));
      make_room(height + 4.0F);
      const float top = y_;
      put_lines(left, regular_, body_size, margin);
      y_ = top;
      put_lines(right, regular_, body_size, margin + first);
      y_ = top - height - 1.0F;
      HPDF_Page_SetGrayStroke(page_, 0.85F);
      line(margin, y_, margin + text_width, y_);
      y_ -= 2.0F;
    }
    y_ -= 5.0F;
  }

  void add(const Pictures& pictures) {
    constexpr float gap = 8.0F;
    constexpr float width = (text_width - gap * (pictures_in_row - 1)) / pictures_in_row;
    constexpr float caption_size = 7.5F;
    const auto& all = pictures.pictures;
    for (std::size_t first = 0; first < all.size(); first += pictures_in_row) {
      const std::size_t end = std::min(all.size(), first + pictures_in_row);
      float height = 0.0F;
      for (std::size_t i = first; i < end; ++i) {
        height = std::max(height, width * static_cast<float>(all[i].second.height) /
                                      static_cast<float>(all[i].second.width));
      }
      make_room(height + 3.0F * caption_size);
      const float top = y_;
      for (std::size_t i = first; i < end; ++i) {
        const auto& [caption, picture] = all[i];
        const float x = margin + (width + gap) * static_cast<float>(i - first);
        const float own =
            width * static_cast<float>(picture.height) / static_cast<float>(picture.width);
        const std::string jpeg = encode_jpeg(picture, jpeg_quality);
        HPDF_Image image = HPDF_LoadJpegImageFromMem(
            document_.get(), reinterpret_cast<const HPDF_BYTE*>(jpeg.data()),
            static_cast<HPDF_UINT>(jpeg.size()));
        HPDF_Page_DrawImage(page_, image, x, top - own, width, own);
        y_ = top - height - 1.0F;
        put_lines(lines_of(caption, regular_, caption_size, width), regular_, caption_size, x);
      }
      y_ = top - height - 3.0F * caption_size;
    }
    y_ -= 4.0F;
  }

  void add(const ErrorBars& chart) {
    constexpr float row_height = 15.0F;
    constexpr float left = margin + 85.0F;
    double most = 1.0;
    for (const ErrorBars::Row& row : chart.rows) {
      most = std::max({most, row.ours.mean + row.ours.sd, row.reference.mean + row.reference.sd});
    }
    const auto x_of = [&](double value) {
      return left +
             static_cast<float>(std::max(0.0, value) / most) * (page_width - margin - 10.0F - left);
    };
    add_text(fmt::format("filled: {}, open: {} [{}]; right end {:.0f}", chart.ours, chart.reference,
                         chart.unit, most),
             regular_, body_size);
    HPDF_Page_SetGrayStroke(page_, 0.3F);
    for (const ErrorBars::Row& row : chart.rows) {
      make_room(row_height);
      const float middle = y_ - 0.5F * row_height;
      const float below = y_ - row_height;
      y_ = middle + 0.4F * body_size;
      put_lines({latin1(row.name)}, regular_, body_size, margin);
      const auto bar = [&](const ErrorBars::Bar& of, float y, bool filled) {
        line(x_of(of.mean - of.sd), y, x_of(of.mean + of.sd), y);
        HPDF_Page_SetGrayFill(page_, filled ? 0.2F : 1.0F);
        HPDF_Page_Circle(page_, x_of(of.mean), y, 2.2F);
        HPDF_Page_FillStroke(page_);
        HPDF_Page_SetGrayFill(page_, 0.0F);
      };
      bar(row.ours, middle + 3.0F, true);
      bar(row.reference, middle - 3.0F, false);
      y_ = below;
    }
    y_ -= 6.0F;
  }

  Result<std::string> finish() {
    const auto failed = [&] {
      return fail(ErrorKind::no_result, "PDF",
                  fmt::format("can't be made (libharu {:#x})", HPDF_GetError(document_.get())));
    };
    if (HPDF_GetError(document_.get()) != HPDF_OK) return failed();
    if (HPDF_SaveToStream(document_.get()) != HPDF_OK) return failed();
    std::string bytes(HPDF_GetStreamSize(document_.get()), '\0');
    auto size = static_cast<HPDF_UINT32>(bytes.size());
    HPDF_ResetStream(document_.get());
    HPDF_ReadFromStream(document_.get(), reinterpret_cast<HPDF_BYTE*>(bytes.data()), &size);
    if (size != bytes.size()) return failed();
    return bytes;
  }

 private:
  void add_page() {
    page_ = HPDF_AddPage(document_.get());
    HPDF_Page_SetWidth(page_, page_width);
    HPDF_Page_SetHeight(page_, page_height);
    HPDF_Page_SetLineWidth(page_, 0.6F);
    ++pages_;
    y_ = 0.5F * margin;
    put_lines({fmt::format("{}", pages_)}, regular_, 8.0F, page_width - margin);
    y_ = page_height - margin;
  }

  void make_room(float height) {
    if (y_ - height < margin) add_page();
  }

  void line(float x0, float y0, float x1, float y1) {
    HPDF_Page_MoveTo(page_, x0, y0);
    HPDF_Page_LineTo(page_, x1, y1);
    HPDF_Page_Stroke(page_);
  }

  float width_of(const std::string& text, HPDF_Font font, float size) {
    HPDF_Page_SetFontAndSize(page_, font, size);
    return HPDF_Page_TextWidth(page_, text.c_str());
  }

  /// Broken between words, and within those that are wider than the column.
  std::vector<std::string> lines_of(const std::string& utf8, HPDF_Font font, float size,
                                    float width) {
    std::vector<std::string> lines = {""};
    const std::string text = latin1(utf8);
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t space = std::min(text.find(' ', at), text.size());
      std::string word = text.substr(at, space - at);
      at = space + 1;
      const std::string joined = lines.back().empty() ? word : lines.back() + " " + word;
      if (width_of(joined, font, size) <= width) {
        lines.back() = joined;
        continue;
      }
      if (!lines.back().empty()) lines.emplace_back();
      for (const char letter : word) {
        if (width_of(lines.back() + letter, font, size) > width) lines.emplace_back();
        lines.back() += letter;
      }
    }
    return lines;
  }

  /// Below each other from y_ down, which follows.
  void put_lines(const std::vector<std::string>& lines, HPDF_Font font, float size, float x) {
    HPDF_Page_SetFontAndSize(page_, font, size);
    for (const std::string& text : lines) {
      y_ -= size * leading;
      HPDF_Page_BeginText(page_);
      HPDF_Page_TextOut(page_, x, y_ + 0.3F * size, text.c_str());
      HPDF_Page_EndText(page_);
    }
  }

  void add_text(const std::string& text, HPDF_Font font, float size, float x = margin,
                float width = text_width) {
    for (const std::string& text_line : lines_of(text, font, size, width)) {
      make_room(size * leading);
      put_lines({text_line}, font, size, x);
    }
  }

  std::unique_ptr<_HPDF_Doc_Rec, void (*)(HPDF_Doc)> document_;
  HPDF_Font regular_ = nullptr;
  HPDF_Font bold_ = nullptr;
  HPDF_Page page_ = nullptr;
  int pages_ = 0;
  float y_ = 0.0F;
};

}  // namespace

Result<std::string> pdf_document(const Report& report) {
  PdfWriter writer;
  writer.add_title(report.title);
  for (const ReportBlock& block : report.blocks) {
    std::visit([&](const auto& b) { writer.add(b); }, block);
  }
  return writer.finish();
}

}  // namespace skullstation
