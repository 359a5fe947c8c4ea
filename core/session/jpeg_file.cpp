#include "core/session/jpeg_file.h"

#include <fmt/format.h>

#include <array>
#include <csetjmp>
#include <cstdio>
#include <string>
// jpeglib.h needs FILE and size_t from above.
#include <jpeglib.h>
// jerror.h needs jpeglib.h.
#include <jerror.h>

namespace skullstation {

namespace {

/// libjpeg reports errors by a callback that must not return: it jumps to `on_error`.
struct JpegErrors {
  jpeg_error_mgr manager{};  // first: libjpeg hands out a pointer to it
  std::jmp_buf on_error{};
  std::array<char, JMSG_LENGTH_MAX> text{};
};

[[noreturn]] void leave(j_common_ptr decoder) {
  auto* errors = static_cast<JpegErrors*>(decoder->client_data);
  decoder->err->format_message(decoder, errors->text.data());
  std::longjmp(errors->on_error, 1);
}

void leave_on_warning(j_common_ptr decoder, int level) {
  if (level >= 0) return;  // a trace message
  // A stray byte or two before a marker is some cameras' habit; many are a picture that lost data.
  constexpr int harmless_bytes = 16;
  const bool harmless = decoder->err->msg_code == JWRN_EXTRANEOUS_DATA &&
                        decoder->err->msg_parm.i[0] <= harmless_bytes;
  if (!harmless) leave(decoder);
}

class JpegDecoder {
 public:
  JpegDecoder() {
    decoder_.err = jpeg_std_error(&errors_.manager);
    errors_.manager.error_exit = leave;
    errors_.manager.emit_message = leave_on_warning;
    decoder_.client_data = &errors_;
    jpeg_create_decompress(&decoder_);
  }
  ~JpegDecoder() { jpeg_destroy_decompress(&decoder_); }
  JpegDecoder(const JpegDecoder&) = delete;
  JpegDecoder& operator=(const JpegDecoder&) = delete;

  // No object with a destructor may be made between a setjmp and its longjmp.
  bool read_header(std::string_view bytes) {
    if (setjmp(errors_.on_error) != 0) return false;
    jpeg_mem_src(&decoder_, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
    jpeg_read_header(&decoder_, TRUE);
    return true;
  }

  bool read_pixels(Image8& image) {
    if (setjmp(errors_.on_error) != 0) return false;
    decoder_.out_color_space = image.channels == 1 ? JCS_GRAYSCALE : JCS_RGB;
    decoder_.dct_method = JDCT_ISLOW;  // the same pixels on every machine
    jpeg_start_decompress(&decoder_);
    while (decoder_.output_scanline < decoder_.output_height) {
      JSAMPROW row = image.row(static_cast<int>(decoder_.output_scanline));
      jpeg_read_scanlines(&decoder_, &row, 1);
    }
    jpeg_finish_decompress(&decoder_);
    return true;
  }

  std::int64_t width() const { return decoder_.image_width; }
  std::int64_t height() const { return decoder_.image_height; }
  int components() const { return decoder_.num_components; }
  const char* error() const { return errors_.text.data(); }

 private:
  jpeg_decompress_struct decoder_{};
  JpegErrors errors_;
};

}  // namespace

Result<Image8> decode_jpeg_file(std::string_view bytes, std::string_view name,
                                std::int64_t max_pixels) {
  JpegDecoder decoder;
  const auto damaged = [&] {
    return fail(ErrorKind::bad_input, std::string(name),
                fmt::format("is a damaged or truncated JPEG image: {}", decoder.error()),
                "copy it again from where it came");
  };
  if (!decoder.read_header(bytes)) return damaged();
  if (decoder.width() * decoder.height() > max_pixels) {
    return fail(ErrorKind::bad_input, std::string(name),
                fmt::format("has {}x{} pixels; at most {} million are read", decoder.width(),
                            decoder.height(), max_pixels / 1'000'000));
  }
  if (decoder.components() != 1 && decoder.components() != 3) {
    return fail(ErrorKind::bad_input, std::string(name),
                fmt::format("is a JPEG image with {} components (CMYK?); grey or colour was "
                            "expected",
                            decoder.components()),
                "save it as RGB");
  }
  Image8 image(static_cast<int>(decoder.width()), static_cast<int>(decoder.height()),
               decoder.components() == 1 ? 1 : 3);
  if (!decoder.read_pixels(image)) return damaged();
  return image;
}

}  // namespace skullstation
