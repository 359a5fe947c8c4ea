#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <thread>

#include "core/random.h"
#include "tests/support/console_user.h"

namespace skullstation::testing {

/// What the console has told so far.
struct Acknowledged {
  std::map<std::int64_t, std::string> saved;         // case to its number
  std::map<std::int64_t, std::size_t> views;         // case to how many pictures it had
  std::map<std::int64_t, nlohmann::json> artifacts;  // job to its files
  std::map<std::int64_t, std::int64_t> reruns;       // job to its case
  std::map<std::int64_t, std::string> holds;         // case to the reason, if nobody knows better
  std::set<std::int64_t> approved;                   // jobs
  std::map<std::string, std::size_t> audit;          // how often something was done
};

/// Does at the console what comes to mind and remembers what was acknowledged.
class Examiner {
 public:
  explicit Examiner(std::size_t cases_wanted) : cases_wanted_(cases_wanted) {}

  /// Are there cases still to be scanned?
  bool wants_more() const { return standing_ < cases_wanted_; }

  bool connect(std::uint16_t port) { return user_.connect(port); }
  bool sign_in(const std::string& path, const nlohmann::json& body) {
    return user_.sign_in(path, body);
  }
  HttpsAnswer ask(const std::string& method, const std::string& path,
                  const nlohmann::json& body = nullptr) {
    const HttpsAnswer answer = user_.ask(method, path, body);
    if (answer.status == 0) gone_ = true;
    return answer;
  }

  /// False when nobody answers any more.
  bool act() {
    gone_ = false;
    at_the_table();
    if (!gone_) with_a_case();
    std::this_thread::sleep_for(std::chrono::milliseconds(random_.below(40)));
    return !gone_;
  }
  const Acknowledged& told() const { return told_; }
  /// As far as is known every case that was wanted came to its end.
  bool all_ended() const { return all_ended_; }

 private:
  nlohmann::json get(const std::string& path) {
    const HttpsAnswer answer = ask("GET", path);
    return answer.status == 200 ? nlohmann::json::parse(answer.body) : nlohmann::json();
  }
  bool change(const std::string& method, const std::string& path, const char* audit,
              const nlohmann::json& body = nullptr) {
    const int status = ask(method, path, body).status;
    if (status >= 200 && status < 300) ++told_.audit[audit];
    return status >= 200 && status < 300;
  }

  void at_the_table();
  void with_a_case();
  void look_at(const nlohmann::json& job);
  void do_something_with(const nlohmann::json& shown);

  ConsoleUser user_;
  Random random_{20260131};
  const std::size_t cases_wanted_;
  Acknowledged told_;
  std::size_t started_ = 0;
  std::size_t standing_ = 0;  ///< cases that were not cancelled
  std::size_t waiting_ = 0;
  bool all_ended_ = false;
  bool gone_ = false;
};

}  // namespace skullstation::testing
