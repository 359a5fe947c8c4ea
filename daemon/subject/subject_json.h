#pragma once

#include <string>

#include "daemon/subject/subject_folder.h"

namespace skullstation {

/// The text of quality.json: every figure of the import, and its findings.
std::string quality_json(const CtSurfaces& surfaces);

/// The text of subject.json: who (without a name, unless the identity was kept), what the scan was,
/// and how the surfaces were made from it.
std::string subject_json(const SubjectSource& source, const CtQuality& quality);

}  // namespace skullstation
