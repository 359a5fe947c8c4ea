#include "daemon/subject/subject_folder.h"

#include <fmt/format.h>

#include "core/file.h"
#include "core/staged_folder.h"
#include "daemon/subject/subject_json.h"
#include "daemon/subject/subject_report.h"
#include "reconstruction/io/ply.h"

namespace skullstation {

namespace fs = std::filesystem;

Result<void> write_subject_folder(const CtSurfaces& surfaces, const SubjectSource& source,
                                  const fs::path& folder, int threads, const Progress& progress) {
  if (const auto free = check_new_folder(folder); !free) return free;
  progress.report(0.0, "drawing the report's pictures");
  const auto report = subject_report(surfaces, source, threads);
  if (!report) return forward(report);
  if (progress.stop.stop_requested()) {
    return fail(ErrorKind::cancelled, folder.string(), "was not written");
  }
  progress.report(0.8, "writing the subject");
  StagedFolder staged(folder);
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
