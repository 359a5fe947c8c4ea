#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_template.h"
#include "reconstruction/statistics/population.h"

namespace skullstation {

struct SubjectFitOptions {
  std::filesystem::path fits;  ///< folder that keeps finished fits between runs
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all
};

/// Fits both templates to one subject's surfaces, the head's from where the fitted skull leads it,
/// and measures the tissue; without name and facts. Fails like register_skull, and with `no_result`
/// where the skull's fit is no use to a model.
Result<ModelSubject> fit_subject(const TriangleMesh& bone, const TriangleMesh& skin,
                                 const SkullTemplate& skull, const HeadTemplate& head,
                                 const SubjectFitOptions& options, const Progress& progress = {});

/// How the templates lie on one subject.
struct SubjectFit {
  ModelSubject subject;
  std::string surfaces_sha256;  ///< of skull.ply and skin.ply
  bool from_before = false;     ///< taken from the fits folder
  std::string failure;          ///< why there is no fit that counts; empty: there is one
  std::string remark;           ///< what has to be said of one that counts; empty: nothing
};

/// Fits both templates to every subject folder (skull.ply, skin.ply, subject.json) below `subjects`
/// in the order of their names, and measures the tissue. What was fitted before from the same
/// surfaces, templates and program version is taken from `fits`. A subject that can't be fitted is
/// reported in its `failure`, and so is one that is another subject again; of one that lacks a bone
/// or much of it the `remark` says so. Fails where `subjects` holds no subject folder or `fits`
/// can't be written, and with `cancelled` on request.
Result<std::vector<SubjectFit>> fit_subjects(const std::filesystem::path& subjects,
                                             const SkullTemplate& skull, const HeadTemplate& head,
                                             const SubjectFitOptions& options,
                                             const Progress& progress = {});

/// What fit_subjects says last: whoever is another one again does not count, and of the others is
/// said what was not observed.
void judge_subjects(const SkullTemplate& skull, std::vector<SubjectFit>& fits);

}  // namespace skullstation
