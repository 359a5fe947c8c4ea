#pragma once

#include <chrono>
#include <map>
#include <mutex>
#include <string>

#include "core/clock.h"

namespace skullstation {

/// How often somebody may ask: a bucket of `burst` tokens for each name, filled at `per_second`.
class RequestLimit {
 public:
  RequestLimit(double per_second, double burst) : per_second_(per_second), burst_(burst) {}

  /// Takes a token; false if there is none.
  bool take(const std::string& name, Instant now);

 private:
  struct Bucket {
    double tokens;
    Instant at;
  };

  const double per_second_;
  const double burst_;
  std::mutex mutex_;
  std::map<std::string, Bucket> buckets_;
};

/// How often somebody may guess a password: five tries are free; after each further wrong one the
/// next must wait twice as long, up to 15 minutes. Counted by account and by address, so that
/// neither one account nor one address gets more.
class GuessLimit {
 public:
  explicit GuessLimit(const Clock& clock) : clock_(clock) {}

  /// How long this account, from this address, has to wait; zero: it may try now. A try that may
  /// go on counts as wrong until right() is called, so that guesses made at once are no cheaper.
  std::chrono::seconds begin(const std::string& account, const std::string& address);
  void right(const std::string& account, const std::string& address);

 private:
  struct Tries {
    int wrong = 0;
    Instant next;
    Instant last;
  };

  void forget_old();

  const Clock& clock_;
  std::mutex mutex_;
  std::map<std::string, Tries> tries_;
};

}  // namespace skullstation
