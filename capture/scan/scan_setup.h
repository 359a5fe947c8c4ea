#pragma once

#include <vector>

#include "capture/scan/scan_session.h"
#include "core/result.h"
#include "core/session/session.h"

namespace skullstation {

// What a scan settles before it touches any hardware.

/// Each ring has its camera and each camera its ring.
Result<void> check_cameras(const ScanPlan& plan, const std::vector<ScanCamera>& cameras);

/// The session as the options want it, without views; image sizes come from the cameras.
Session wanted_session(const ScanOptions& options, const ScanStation& station);

}  // namespace skullstation
