#include "daemon/http/limits.h"

#include <algorithm>
#include <array>

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr std::size_t most_names = 10000;

}  // namespace

bool RequestLimit::take(const std::string& name, Instant now) {
  const std::lock_guard lock(mutex_);
  // A full bucket says no more than none.
  if (buckets_.size() >= most_names) {
    std::erase_if(buckets_, [&](const auto& entry) {
      const std::chrono::duration<double> since = now - entry.second.at;
      return entry.second.tokens + since.count() * per_second_ >= burst_;
    });
  }
  auto [entry, added] = buckets_.try_emplace(name, Bucket{burst_, now});
  Bucket& bucket = entry->second;
  const std::chrono::duration<double> since = now - bucket.at;
  bucket.tokens = std::min(burst_, bucket.tokens + since.count() * per_second_);
  bucket.at = now;
  if (bucket.tokens < 1.0) return false;
  bucket.tokens -= 1.0;
  return true;
}

std::chrono::seconds GuessLimit::begin(const std::string& account, const std::string& address) {
  constexpr int free_tries = 5;
  constexpr std::chrono::seconds longest = 15min;
  const std::lock_guard lock(mutex_);
  forget_old();
  const Instant now = clock_.now();
  const std::array names{"account " + account, "address " + address};
  for (const std::string& name : names) {
    const auto found = tries_.find(name);
    if (found != tries_.end() && found->second.next > now) {
      return std::chrono::ceil<std::chrono::seconds>(found->second.next - now);
    }
  }
  for (const std::string& name : names) {
    Tries& tries = tries_[name];
    ++tries.wrong;
    tries.last = now;
    const int doublings = std::clamp(tries.wrong - free_tries, 0, 16);
    if (tries.wrong >= free_tries) tries.next = now + std::min(longest, 1s * (1 << doublings));
  }
  return 0s;
}

void GuessLimit::right(const std::string& account, const std::string& address) {
  const std::lock_guard lock(mutex_);
  tries_.erase("account " + account);
  tries_.erase("address " + address);
}

void GuessLimit::forget_old() {
  if (tries_.size() < most_names) return;
  const Instant now = clock_.now();
  std::erase_if(tries_, [&](const auto& entry) { return now - entry.second.last > 1h; });
  // More names than an institution has within an hour are an attack: the oldest go first.
  while (tries_.size() >= most_names) {
    tries_.erase(
        std::ranges::min_element(tries_, {}, [](const auto& entry) { return entry.second.last; }));
  }
}

}  // namespace skullstation
