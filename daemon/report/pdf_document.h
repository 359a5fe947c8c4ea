#pragma once

#include <string>

#include "core/result.h"
#include "daemon/report/report.h"

namespace skullstation {

/// The report as a PDF of A4 pages, pictures and all. Letters outside Latin-1 become question
/// marks. The same bytes for the same report. Fails with `no_result` where the PDF library does.
Result<std::string> pdf_document(const Report& report);

}  // namespace skullstation
