#pragma once

#include <string>

#include "daemon/evidence/time_stamp.h"

namespace skullstation {

/// Asks the authority at this http(s) address (RFC 3161, 3.4). The answer's content is not looked
/// at. Fails as deliveries do: `hardware` where nobody answers, `bad_input` where it is refused.
TimeStamper time_stamper_at(std::string url);

}  // namespace skullstation
