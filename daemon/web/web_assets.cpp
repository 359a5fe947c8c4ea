#include "daemon/web/web_assets.h"

#include <zlib.h>

#include <array>
#include <map>

#include "core/file.h"

// web_assets.S
extern "C" {
extern const char skullstation_web_page[], skullstation_web_page_end[];
extern const char skullstation_web_script[], skullstation_web_script_end[];
extern const char skullstation_web_style[], skullstation_web_style_end[];
extern const char skullstation_web_icon[], skullstation_web_icon_end[];
extern const char skullstation_web_openapi[], skullstation_web_openapi_end[];
}

namespace skullstation {

namespace {

std::string_view between(const char* begin, const char* end) {
  return {begin, static_cast<std::size_t>(end - begin)};
}

std::string gzipped(std::string_view bytes) {
  constexpr int gzip_header = 16;
  z_stream stream{};
  deflateInit2(&stream, Z_BEST_COMPRESSION, Z_DEFLATED, MAX_WBITS + gzip_header, 8,
               Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, bytes.size()), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  stream.avail_in = static_cast<uInt>(bytes.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  deflate(&stream, Z_FINISH);  // ends at once: deflateBound() left room for all of it
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

WebAsset asset(std::string_view content_type, std::string_view bytes) {
  return {content_type, bytes, gzipped(bytes), sha256_hex(bytes)};
}

}  // namespace

const WebAsset* find_web_asset(std::string_view path) {
  static const std::map<std::string_view, WebAsset> assets = {
      {"/", asset("text/html; charset=utf-8",
                  between(skullstation_web_page, skullstation_web_page_end))},
      {"/console.js", asset("text/javascript; charset=utf-8",
                            between(skullstation_web_script, skullstation_web_script_end))},
      {"/console.css", asset("text/css; charset=utf-8",
                             between(skullstation_web_style, skullstation_web_style_end))},
      {"/icon.svg",
       asset("image/svg+xml", between(skullstation_web_icon, skullstation_web_icon_end))}};
  const auto found = assets.find(path);
  return found == assets.end() ? nullptr : &found->second;
}

std::string_view openapi_description() {
  return between(skullstation_web_openapi, skullstation_web_openapi_end);
}

}  // namespace skullstation
