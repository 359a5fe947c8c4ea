#include "daemon/http/event_hub.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/service/service_json.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr std::size_t most_listeners = 400;
constexpr auto replace = nlohmann::json::error_handler_t::replace;

std::string status_event(const std::string& status) {
  return fmt::format("event: station\ndata: {}\n\n", status);
}

std::string line_event(const LogLine& line) {
  const nlohmann::ordered_json json = {{"time", line.time}, {"words", line.words}};
  return fmt::format("id: {}\nevent: log\ndata: {}\n\n", line.number,
                     json.dump(-1, ' ', false, replace));
}

}  // namespace

EventHub::EventHub(StationService& service, Accounts& accounts)
    : service_(service),
      accounts_(accounts),
      thread_([this](const std::stop_token& stop) { run(stop); }) {}

EventHub::~EventHub() {
  thread_.request_stop();
  thread_.join();
  for (const Listener& listener : listeners_) listener.queue->close();
}

std::shared_ptr<EventQueue> EventHub::listen(const std::string& token, std::uint64_t last_line) {
  const std::string status = status_json(service_).dump(-1, ' ', false, replace);
  const std::lock_guard lock(mutex_);
  std::erase_if(listeners_, [](const Listener& listener) { return listener.queue->closed(); });
  if (listeners_.size() >= most_listeners) return nullptr;
  auto queue = std::make_shared<EventQueue>();
  queue->push("retry: 2000\n\n" + status_event(status));
  for (const LogLine& line : service_.log_after(last_line)) {
    if (line.number <= line_) queue->push(line_event(line));  // later ones come to everybody
  }
  listeners_.push_back({token, queue});
  return queue;
}

void EventHub::run(const std::stop_token& stop) {
  SystemClock clock;
  for (int looks = 1; clock.sleep_for(250ms, stop); ++looks) {
    look();
    if (looks % 40 == 0) say_alive();
  }
}

void EventHub::look() {
  std::string status = status_json(service_).dump(-1, ' ', false, replace);
  const std::lock_guard lock(mutex_);
  std::string news;
  for (const LogLine& line : service_.log_after(line_)) {
    news += line_event(line);
    line_ = line.number;
  }
  if (status != status_) {
    news += status_event(status);
    status_ = std::move(status);
  }
  if (news.empty()) return;
  for (const Listener& listener : listeners_) listener.queue->push(news);
}

/// Finds who has gone without a word, and ends the streams of those who may no longer listen.
void EventHub::say_alive() {
  std::vector<Listener> listeners;
  {
    const std::lock_guard lock(mutex_);
    std::erase_if(listeners_, [](const Listener& listener) { return listener.queue->closed(); });
    listeners = listeners_;
  }
  for (const Listener& listener : listeners) {
    const auto still = accounts_.still_signed_in(listener.token);
    if (still && *still) {
      listener.queue->push(": alive\n\n");
    } else {
      listener.queue->close();
    }
  }
}

}  // namespace skullstation
