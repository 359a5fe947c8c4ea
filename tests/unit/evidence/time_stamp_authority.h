#pragma once

#include <filesystem>

#include "daemon/evidence/time_stamp.h"

namespace skullstation::testing {

/// A time-stamping authority of its own, played by `openssl ts`. Its keys are made with it.
class TimeStampAuthority {
 public:
  explicit TimeStampAuthority(const std::filesystem::path& folder);

  /// Answers as an authority on the network would.
  TimeStamper stamper() const;
  const std::filesystem::path& folder() const { return folder_; }
  std::filesystem::path certificate() const { return folder_ / "tsa.pem"; }

 private:
  std::filesystem::path folder_;
};

}  // namespace skullstation::testing
