#include <cstddef>
#include <cstdint>
#include <string_view>

#include "core/session/session.h"

/// Whatever is read can be written, and the text reads as the same text again but for poses, whose
/// rotations are rounded once.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  auto session = skullstation::parse_session(text, "session.json");
  if (!session) return session.error().what.empty() ? -1 : 0;
  for (auto& view : session->views) {
    if (view.image.starts_with("/") || view.image.starts_with("..")) __builtin_trap();
    view.camera_from_table.reset();
  }
  const auto written = skullstation::format_session(*session);
  if (!written) __builtin_trap();
  const auto read = skullstation::parse_session(*written, "session.json");
  if (!read) __builtin_trap();
  const auto again = skullstation::format_session(*read);
  if (!again || *again != *written) __builtin_trap();
  return 0;
}
