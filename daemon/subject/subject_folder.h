#pragma once

#include <filesystem>
#include <string>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/volume/ct_surfaces.h"
#include "reconstruction/volume/volume.h"

namespace skullstation {

/// Where a subject's surfaces come from.
struct SubjectSource {
  VolumeInfo info;     ///< of the scan as it was read
  VoxelGrid grid;      ///< of the scan as it was read
  std::string sha256;  ///< volume_sha256 of the scan as it was read
  CtSurfaceOptions options;
  std::string program_version;
};

/// Writes a subject's folder: skull.ply and skin.ply (patient frame, mm), quality.json,
/// subject.json and report.html. The folder appears whole or not at all. The same bytes for any
/// number of threads. Fails as check_new_folder does, with the system's reason where it can't
/// be written, `cancelled` on request.
Result<void> write_subject_folder(const CtSurfaces& surfaces, const SubjectSource& source,
                                  const std::filesystem::path& folder, int threads,
                                  const Progress& progress = {});

}  // namespace skullstation
