#pragma once

#include <functional>
#include <stop_token>
#include <string_view>

namespace skullstation {

/// How a long computation reports and how it is told to stop. Passed by const reference; the
/// default does neither. `report` may be called from one thread at a time.
struct Progress {
  std::function<void(double fraction, std::string_view stage)> report = [](double,
                                                                           std::string_view) {};
  std::stop_token stop;

  /// The part [begin, end] of this progress as a progress of its own.
  Progress part(double begin, double end) const {
    return {[report = report, begin, end](double fraction, std::string_view stage) {
              report(begin + (end - begin) * fraction, stage);
            },
            stop};
  }
};

}  // namespace skullstation
