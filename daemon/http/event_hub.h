#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "daemon/http/accounts.h"
#include "daemon/http/event_queue.h"
#include "daemon/service/station_service.h"

namespace skullstation {

/// Tells everybody who listens what happens at the station, as server-sent events:
///   station  the status, whenever it has changed
///   log      a line; its id lets a listener who was cut off go on where he was
/// Looks four times a second, whoever listens: one look for all.
class EventHub {
 public:
  EventHub(StationService& service, Accounts& accounts);
  ~EventHub();  ///< ends every stream
  EventHub(const EventHub&) = delete;
  EventHub& operator=(const EventHub&) = delete;

  /// A stream for who holds this token, until he no longer does; it begins with the status and the
  /// lines after `last_line`. Null if too many listen already.
  std::shared_ptr<EventQueue> listen(const std::string& token, std::uint64_t last_line);

 private:
  struct Listener {
    std::string token;
    std::shared_ptr<EventQueue> queue;
  };

  void run(const std::stop_token& stop);
  void look();
  void say_alive();

  StationService& service_;
  Accounts& accounts_;
  std::mutex mutex_;  // guards what follows
  std::vector<Listener> listeners_;
  std::string status_;  // as it was told last
  std::uint64_t line_ = 0;
  std::jthread thread_;  // last: it uses everything above
};

}  // namespace skullstation
