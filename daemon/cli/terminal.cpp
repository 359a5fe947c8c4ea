#include "daemon/cli/terminal.h"

#include <fmt/format.h>
#include <pthread.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <exception>
#include <nlohmann/json.hpp>

namespace skullstation {

using namespace std::chrono_literals;

std::string to_words(std::chrono::seconds duration) {
  const auto s = duration.count();
  if (s < 60) return fmt::format("{} s", s);
  if (s < 3600) return fmt::format("{} min {} s", s / 60, s % 60);
  return fmt::format("{} h {} min", s / 3600, s / 60 % 60);
}

ProgressBar::ProgressBar()
    : on_terminal_(::isatty(STDERR_FILENO) != 0), start_(std::chrono::steady_clock::now()) {}

ProgressBar::~ProgressBar() {
  if (on_terminal_ && shown_permille_ >= 0) fmt::print(stderr, "\r\033[K");
}

Progress ProgressBar::progress(std::stop_token stop) {
  return {[this](double fraction, std::string_view stage) { show(fraction, stage); },
          std::move(stop)};
}

void ProgressBar::show(double fraction, std::string_view stage) {
  const std::lock_guard lock(mutex_);
  const int permille = static_cast<int>(std::lround(1000.0 * std::clamp(fraction, 0.0, 1.0)));
  const int grain = on_terminal_ ? 1 : 100;
  if (permille / grain == shown_permille_ / grain && shown_permille_ >= 0 &&
      (!on_terminal_ || stage == shown_stage_)) {
    return;
  }
  shown_permille_ = permille;
  shown_stage_ = stage;
  std::string left;
  if (permille >= 20 && permille < 1000) {
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start_;
    left = ", about " +
           to_words(
               std::chrono::ceil<std::chrono::seconds>(elapsed * (1000.0 - permille) / permille)) +
           " left";
  }
  if (on_terminal_) {
    constexpr int width = 28;
    const int filled = width * permille / 1000;
    fmt::print(stderr, "\r\033[K[{:#<{}}{:.<{}}] {:3d} %{}  {}", "", filled, "", width - filled,
               permille / 10, left, stage);
    std::fflush(stderr);
  } else {
    fmt::print(stderr, "{:3d} %{}  {}\n", permille / 10, left, stage);
  }
}

StopOnSignal::StopOnSignal() {
  sigset_t signals;
  sigemptyset(&signals);
  sigaddset(&signals, SIGINT);
  sigaddset(&signals, SIGTERM);
  pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  waiter_ = std::jthread([this, signals](const std::stop_token& end) {
    const timespec slice{0, 100'000'000};
    while (!end.stop_requested()) {
      if (sigtimedwait(&signals, nullptr, &slice) < 0) continue;
      if (stop_.stop_requested()) ::_exit(exit_code(ErrorKind::cancelled));
      stop_.request_stop();
    }
  });
}

std::string printable(std::string text) {
  std::ranges::replace_if(
      text, [](char c) { return (c >= 0 && c < 32 && c != '\n' && c != '\t') || c == 127; }, '?');
  return text;
}

int finish(const Result<CommandReport>& result, bool json) {
  if (result) {
    const std::string text = json ? result->json : printable(result->text);
    fmt::print("{}{}", text, text.empty() || text.back() == '\n' ? "" : "\n");
    return result->exit_code;
  }
  const Error& error = result.error();
  fmt::print(stderr, "skullstation: {}\n", printable(error.message()));
  if (json) {
    const nlohmann::ordered_json object = {{"error",
                                            {{"kind", to_string(error.kind)},
                                             {"where", error.where},
                                             {"what", error.what},
                                             {"advice", error.advice}}}};
    fmt::print("{}\n", object.dump(2));
  }
  return exit_code(error.kind);
}

int guarded(const char* program, const std::function<int()>& body) noexcept {
  try {
    return body();
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: ended by a mistake of its own or a lack of memory (%s)\n", program,
                 error.what());
  } catch (...) {
    std::fprintf(stderr, "%s: ended by a mistake of its own\n", program);
  }
  return 5;
}

}  // namespace skullstation
