#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "core/clock.h"
#include "core/result.h"
#include "daemon/evidence/trust.h"

namespace skullstation {

/// Sends a request to a time-stamping authority and returns its answer (RFC 3161, both DER).
using TimeStamper = std::function<Result<std::string>(const std::string& query)>;

/// Asks for a stamp of the message's SHA-256, with a random nonce and the authority's certificate.
std::string time_stamp_query(std::string_view message);

/// What an authority confirms: these bytes were there at that time.
struct TimeStamp {
  std::string authority;  ///< subject of its certificate, "CN = TSA"
  std::string time;       ///< UTC, ISO 8601, by the authority's clock
  UtcTime stamped_at;
  std::string serial;  ///< hexadecimal; names the stamp at the authority
};

/// Reads an authority's answer: fails if it refused, or if what it holds is no stamp of the
/// message, signed by the certificate in it, that may stamp times. `query`, if it is known, must be
/// what was asked. Whether the authority deserves trust is not looked at.
Result<TimeStamp> read_time_stamp(std::string_view answer, std::string_view message,
                                  std::string_view query = {});

/// Does the authority's certificate lead, at the time of the stamp, to a trusted certificate? Says
/// why not. For an answer that read_time_stamp() took.
Result<void> trusts_time_stamp(const Trust& trust, std::string_view answer);

}  // namespace skullstation
