#pragma once

#include "core/progress.h"
#include "core/result.h"
#include "daemon/model/model_source.h"
#include "daemon/report/captioned_pictures.h"
#include "daemon/report/report.h"

namespace skullstation {

/// What a model knows, for people: skulls and heads along their first two modes, mean and
/// standard deviation of the soft tissue on the mean skull, how many subjects tell of each place,
/// the depths at the landmarks beside the T-Table (Hona & Stephan 2024), the card. Figures after
/// Gietzen et al. 2019. Fails with `cancelled` on request.
Result<Report> model_report(const ModelSource& source, const ReportPictureOptions& options,
                            const Progress& progress = {});

}  // namespace skullstation
