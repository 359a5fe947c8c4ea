#include "firmware_io/simulated_station.h"

#include <algorithm>
#include <deque>
#include <mutex>
#include <utility>

#include "core/random.h"
#include "firmware_io/press_detector.h"
#include "firmware_io/simulated_platter.h"
#include "firmware_io/step_driver.h"
#include "firmware_io/stepped_turntable.h"
#include "firmware_io/trip_latch.h"

namespace skullstation {

using namespace std::chrono_literals;

namespace {

constexpr auto estop_pressed_text = "emergency stop pressed";
constexpr std::chrono::milliseconds longest_wait = std::chrono::hours{24 * 365};
constexpr auto pause_between_presses = 100ms;

/// What a contact does around the moment `at`: one clean edge, or a burst that ends at `down`.
void move_contact(PressDetector& detector, Instant at, bool down, bool bounces, Random& random) {
  detector.edge(at, down);
  if (!bounces) return;
  const int reversals = 2 * (1 + static_cast<int>(random.below(4)));
  bool level = down;
  for (int i = 0; i < reversals; ++i) {
    at += std::chrono::microseconds{200 + random.below(1800)};
    level = !level;
    detector.edge(at, level);
  }
}

}  // namespace

/// Everything the parts share. Lock order: the latch's own lock before `mutex`.
struct SimulatedStation::World {
  World(const TurntableConfig& turntable_config, const SimulatedFaults& simulated_faults,
        Clock& world_clock, std::uint64_t seed)
      : config(turntable_config),
        faults(simulated_faults),
        clock(world_clock),
        platter(config, {faults.slip_fraction, faults.stall_at_deg, faults.index_switch_missing},
                mix(seed, 0)),
        bounce(mix(seed, 1)),
        latch({[this] { return still_active(); }, [this] { enable(false); }}) {}

  void enable(bool on) {
    const std::lock_guard lock(mutex);
    switch_current([&] { enabled = on; });
  }

  void step() {
    bool hits_stop = false;
    {
      const std::lock_guard lock(mutex);
      if (!current_on()) return;
      platter.step(direction, clock.now());
      hits_stop = faults.estop_after_turn_deg && !estop_was_hit &&
                  platter.commanded_turn_deg() >= *faults.estop_after_turn_deg;
      estop_was_hit |= hits_stop;
    }
    if (hits_stop) press_estop();
  }

  void press_estop() {
    {
      const std::lock_guard lock(mutex);
      switch_current([&] { estop_pressed = true; });
    }
    latch.trip(estop_pressed_text);
  }

  Result<std::string> still_active() {
    const std::lock_guard lock(mutex);
    return estop_pressed || faults.estop_stuck ? estop_pressed_text : "";
  }

  void press_button(std::chrono::milliseconds held) {
    const std::lock_guard lock(mutex);
    const Instant down = std::max(clock.now(), button_free_at);
    const Instant up = down + held;
    const ButtonTiming timing;
    PressDetector detector(timing);
    move_contact(detector, down, true, faults.button_bounces, bounce);
    move_contact(detector, up, false, faults.button_bounces, bounce);
    button_free_at = up + pause_between_presses;
    for (const auto& press : detector.advance(button_free_at)) presses.push_back(press);
    waiter.request_stop();
  }

  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              const std::stop_token& stop) {
    const Instant deadline = clock.now() + std::min(timeout, longest_wait);
    for (;;) {
      std::stop_source wake;
      Instant until = deadline;
      {
        const std::lock_guard lock(mutex);
        const Instant now = clock.now();
        if (!presses.empty() && presses.front().at <= now) {
          const Press press = presses.front().press;
          presses.pop_front();
          return press;
        }
        if (stop.stop_requested() || now >= deadline) return std::nullopt;
        if (!presses.empty()) until = std::min(deadline, presses.front().at);
        waiter = wake;
      }
      const std::stop_callback on_stop(stop, [&wake] { wake.request_stop(); });
      clock.sleep_until(until, wake.get_token());
    }
  }

  bool current_on() const { return enabled && !estop_pressed; }

  template <class Change>
  void switch_current(Change change) {
    const bool was_on = current_on();
    change();
    if (was_on && !current_on()) platter.let_go(clock.now());
  }

  class Motor;
  class PanelButton;
  class Lamp;
  class SpecimenLights;

  const TurntableConfig config;
  const SimulatedFaults faults;
  Clock& clock;

  mutable std::mutex mutex;  // guards what follows, up to the latch
  SimulatedPlatter platter;
  bool enabled = false;
  int direction = 1;
  bool estop_pressed = false;
  bool estop_was_hit = false;
  Signal signal = Signal::off;
  bool lights = false;
  Random bounce;
  std::deque<PressDetector::Detected> presses;
  Instant button_free_at = Instant::min();
  std::stop_source waiter{std::nostopstate};  // wakes whoever waits for a press

  TripLatch latch;
};

class SimulatedStation::World::Motor final : public StepDriver {
 public:
  explicit Motor(World& world) : world_(world) {}

  Result<void> set_current(bool on) override {
    world_.enable(on);
    return {};
  }
  Result<void> set_direction(int new_direction) override {
    const std::lock_guard lock(world_.mutex);
    world_.direction = new_direction;
    return {};
  }
  Result<void> step() override {
    world_.step();
    return {};
  }
  Result<bool> index_closed() override {
    const std::lock_guard lock(world_.mutex);
    return world_.platter.index_closed();
  }
  Result<void> prepare_thread() override { return {}; }
  void wait_until(Instant deadline) override { world_.clock.sleep_until(deadline, {}); }

 private:
  World& world_;
};

class SimulatedStation::World::PanelButton final : public Button {
 public:
  explicit PanelButton(World& world) : world_(world) {}

  Result<std::optional<Press>> wait_for_press(std::chrono::milliseconds timeout,
                                              std::stop_token stop) override {
    return world_.wait_for_press(timeout, stop);
  }

 private:
  World& world_;
};

class SimulatedStation::World::Lamp final : public SignalLamp {
 public:
  explicit Lamp(World& world) : world_(world) {}
  ~Lamp() override { set(Signal::off); }
  Lamp(const Lamp&) = delete;
  Lamp& operator=(const Lamp&) = delete;

  Result<void> show(Signal shown) override {
    set(shown);
    return {};
  }

 private:
  void set(Signal shown) {
    const std::lock_guard lock(world_.mutex);
    world_.signal = shown;
  }

  World& world_;
};

class SimulatedStation::World::SpecimenLights final : public Lights {
 public:
  explicit SpecimenLights(World& world) : world_(world) {}
  ~SpecimenLights() override { switch_to(false); }
  SpecimenLights(const SpecimenLights&) = delete;
  SpecimenLights& operator=(const SpecimenLights&) = delete;

  Result<void> set(bool on) override {
    switch_to(on);
    return {};
  }

 private:
  void switch_to(bool on) {
    const std::lock_guard lock(world_.mutex);
    world_.lights = on;
  }

  World& world_;
};

SimulatedStation::SimulatedStation(const TurntableConfig& config, const SimulatedFaults& faults,
                                   Clock& clock, std::uint64_t seed)
    : world_(std::make_unique<World>(config, faults, clock, seed)) {}

SimulatedStation::~SimulatedStation() = default;

StationHardware SimulatedStation::hardware() {
  const std::shared_ptr<TripLatch> latch(std::shared_ptr<void>{}, &world_->latch);  // not owned
  return {std::make_unique<LatchedInterlock>(latch), std::make_unique<World::PanelButton>(*world_),
          std::make_unique<World::Lamp>(*world_), std::make_unique<World::SpecimenLights>(*world_),
          std::make_unique<SteppedTurntable>(std::make_unique<World::Motor>(*world_), latch,
                                             world_->config, world_->clock)};
}

double SimulatedStation::true_table_angle_deg(Instant at) const {
  const std::lock_guard lock(world_->mutex);
  return world_->platter.angle_deg(at);
}

void SimulatedStation::press_button(std::chrono::milliseconds held) { world_->press_button(held); }

void SimulatedStation::press_estop() { world_->press_estop(); }

void SimulatedStation::release_estop() {
  const std::lock_guard lock(world_->mutex);
  world_->estop_pressed = false;
}

Signal SimulatedStation::shown_signal() const {
  const std::lock_guard lock(world_->mutex);
  return world_->signal;
}

bool SimulatedStation::lights_on() const {
  const std::lock_guard lock(world_->mutex);
  return world_->lights;
}

bool SimulatedStation::motor_current_on() const {
  const std::lock_guard lock(world_->mutex);
  return world_->current_on();
}

}  // namespace skullstation
