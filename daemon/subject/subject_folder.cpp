#include "daemon/subject/subject_folder.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <system_error>
#include <utility>

#include "core/file.h"
#include "daemon/subject/subject_json.h"
#include "daemon/subject/subject_report.h"
#include "reconstruction/io/ply.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// The folder under another name beside its place; removed unless it is put there.
class StagedFolder {
 public:
  explicit StagedFolder(fs::path place) : place_(std::move(place)) {
    staged_ = place_.parent_path() / fmt::format(".{}.unfinished", place_.filename().string());
    std::error_code ignored;
    fs::remove_all(staged_, ignored);
  }
  ~StagedFolder() {
    std::error_code ignored;
    if (!done_) fs::remove_all(staged_, ignored);
  }
  StagedFolder(const StagedFolder&) = delete;
  StagedFolder& operator=(const StagedFolder&) = delete;

  fs::path operator/(const char* name) const { return staged_ / name; }
  Result<void> make() const { return make_writable_folder(staged_); }

  Result<void> put_in_place() {
    std::error_code error;
    fs::rename(staged_, place_, error);
    if (error) return fail(ErrorKind::bad_input, place_.string(), error.message());
    done_ = true;
    sync(place_.parent_path());
    return {};
  }

 private:
  static void sync(const fs::path& folder) {
    const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
    if (descriptor < 0) return;
    ::fsync(descriptor);
    ::close(descriptor);
  }

  fs::path place_;
  fs::path staged_;
  bool done_ = false;
};

fs::path without_trailing_slash(const fs::path& folder) {
  const fs::path absolute = fs::absolute(folder).lexically_normal();
  return absolute.has_filename() ? absolute : absolute.parent_path();
}

}  // namespace

Result<void> check_subject_folder(const fs::path& folder) {
  std::error_code ignored;
  const bool is_there = fs::exists(folder, ignored);
  if (!is_there || (fs::is_directory(folder, ignored) && fs::is_empty(folder, ignored))) return {};
  return fail(ErrorKind::usage, folder.string(), "is there already and is not empty",
              "name a new folder, or move this one away");
}

Result<void> write_subject_folder(const CtSurfaces& surfaces, const SubjectSource& source,
                                  const fs::path& folder, int threads, const Progress& progress) {
  if (const auto free = check_subject_folder(folder); !free) return free;
  progress.report(0.0, "drawing the report's pictures");
  const auto report = subject_report(surfaces, source, threads);
  if (!report) return forward(report);
  if (progress.stop.stop_requested()) {
    return fail(ErrorKind::cancelled, folder.string(), "was not written");
  }
  progress.report(0.8, "writing the subject");
  StagedFolder staged(without_trailing_slash(folder));
  for (const auto& written :
       {staged.make(), write_ply(surfaces.skull, staged / "skull.ply"),
        write_ply(surfaces.skin, staged / "skin.ply"),
        write_file_durably(staged / "quality.json", quality_json(surfaces)),
        write_file_durably(staged / "subject.json", subject_json(source, surfaces.quality)),
        write_file_durably(staged / "report.html", *report)}) {
    if (!written) return written;
  }
  return staged.put_in_place();
}

}  // namespace skullstation
