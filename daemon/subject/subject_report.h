#pragma once

#include <string>

#include "core/result.h"
#include "daemon/subject/subject_folder.h"

namespace skullstation {

/// The text of report.html: what was found, in plain words first; pictures of both surfaces and of
/// slices with both drawn in; the figures; the scan and the options.
Result<std::string> subject_report(const CtSurfaces& surfaces, const SubjectSource& source,
                                   int threads);

}  // namespace skullstation
