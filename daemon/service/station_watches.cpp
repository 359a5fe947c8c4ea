// What the running station looks at while nobody asks: its button, its cameras, its files.

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include "daemon/service/sealed_cases.h"
#include "daemon/service/station_service.h"

namespace skullstation {

using namespace std::chrono_literals;

void StationService::watch_button(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    const auto press = station_->hardware.button->wait_for_press(1s, stop);
    if (!press) {
      log("button: " + press.error().message());
      clock_.sleep_for(1s, stop);
    } else if (*press) {
      tell(**press == Press::brief ? StationEvent::go : StationEvent::cancel);
    }
  }
}

/// A camera that was unplugged is told of before the next specimen lies on the table.
void StationService::watch_cameras(const std::stop_token& stop) {
  bool lost = false;
  const auto period = std::chrono::seconds(options_.config.camera_check_s);
  while (clock_.sleep_for(period, stop)) {
    const std::unique_lock lock(cameras_mutex_, std::try_to_lock);
    const StationState state = status().state;
    const bool idle = state == StationState::ready || state == StationState::building ||
                      state == StationState::result;
    if (!lock || (!idle && !(lost && state == StationState::fault))) continue;
    std::string trouble;
    for (StationCamera& camera : station_->cameras) {
      Camera& device = *camera.camera;
      if (lost && !device.reopen()) {
        trouble = camera.config.id;
        continue;
      }
      const auto frame =
          device.frame_after(station_->clock->now(), options_.config.scan.frame_timeout, stop);
      if (!frame && !stop.stop_requested()) {
        trouble = fmt::format("camera \"{}\": {}", camera.config.id, frame.error().message());
      }
    }
    if (!trouble.empty() && !lost) {
      say(trouble);
      tell(StationEvent::camera_lost);
    }
    if (trouble.empty() && lost) tell(StationEvent::camera_back);
    lost = !trouble.empty();
  }
}

/// Disks forget. Every file of every case is read after each start and then once a week, as slowly
/// as whoever else needs the machine wants.
void StationService::watch_files(const std::stop_token& stop) {
  constexpr auto period = std::chrono::hours(7 * 24);
  static_cast<void>(::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), 19));
  do {
    const auto cases = store_->cases();
    if (!cases) log(cases.error().message());
    for (const Case& row : cases.value_or(std::vector<Case>{})) {
      auto damage = store_->check_case(row.id, stop);
      if (stop.stop_requested()) return;
      if (!damage) damage = std::vector{damage.error().message()};
      for (const std::string& words : *damage) {
        log(fmt::format("case {}: {}", row.number, words));
      }
      const std::lock_guard lock(mutex_);
      damage_[row.id] = *std::move(damage);
    }
  } while (clock_.sleep_for(period, stop));
}

void StationService::remove_expired() {
  const int days = options_.config.storage.keep_days;
  if (days == 0) return;
  const auto removed = store_->remove_expired(std::chrono::days(days));
  if (!removed) {
    log(removed.error().message());
  } else if (!removed->empty()) {
    log(fmt::format("{} cases were deleted: delivered, verified, expired", removed->size()));
  }
  if (const auto swept = remove_packages_of_deleted_cases(*store_); !swept) {
    log(swept.error().message());
  }
}

}  // namespace skullstation
