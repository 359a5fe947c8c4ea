#include "core/session/session.h"

#include <fmt/format.h>

#include "core/file.h"

namespace skullstation {

namespace fs = std::filesystem;

Result<Session> read_session(const fs::path& folder) {
  const fs::path file = folder / "session.json";
  std::error_code ignored;
  if (!fs::exists(file, ignored)) {
    return fail(ErrorKind::bad_input, folder.string(),
                "is not a capture session: it has no session.json",
                "docs/sessions.md shows how to write one for photographs of your own");
  }
  const Result<std::string> text = read_file(file);
  if (!text) return forward(text);
  return parse_session(*text, file.string());
}

Result<void> write_session(const Session& session, const fs::path& folder) {
  const Result<std::string> text = format_session(session);
  if (!text) return forward(text);
  return write_file_durably(folder / "session.json", *text);
}

Result<void> verify_image(const SessionView& view, const fs::path& folder) {
  const fs::path file = folder / view.image;
  const Result<std::string> bytes = read_file(file);
  if (!bytes) return forward(bytes);
  if (view.sha256 && sha256_hex(*bytes) != *view.sha256) {
    return fail(ErrorKind::bad_input, file.string(),
                "is not the image that was recorded: its SHA-256 differs from session.json");
  }
  return {};
}

Result<void> verify_images(const Session& session, const fs::path& folder) {
  for (const SessionView& view : session.views) {
    if (Result<void> intact = verify_image(view, folder); !intact) return intact;
  }
  return {};
}

}  // namespace skullstation
