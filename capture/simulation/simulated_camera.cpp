#include "capture/simulation/simulated_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <utility>

#include "capture/cameras/camera_settings.h"
#include "core/random.h"

namespace skullstation {

using std::chrono::microseconds;
using std::chrono::nanoseconds;

namespace {

/// How often the table's angle is asked for within an exposure.
constexpr int angles_per_exposure = 17;
constexpr microseconds readout{1000};
constexpr double nearest_focus_mm = 200.0;
/// A lamp's reflection or a forgotten ceiling light: one and a half stops.
constexpr float overexposure = 2.8F;

/// Settings in the units of the simulated device, as UVC cameras have them.
struct ControlRange {
  const char* name;
  std::int64_t minimum, maximum, step, default_value;

  std::int64_t nearest(std::int64_t value) const {
    const std::int64_t inside = std::clamp(value, minimum, maximum);
    return minimum + (inside - minimum + step / 2) / step * step;
  }
};
constexpr ControlRange exposure_range{"exposure_time_us", 100, 200'000, 100, 8000};
constexpr ControlRange gain_range{"gain_percent", 100, 1600, 10, 100};
constexpr ControlRange white_balance_range{"white_balance_temperature", 2800, 8000, 100, 5500};
constexpr ControlRange focus_range{"focus_absolute", 0, 250, 1, 0};

/// Focus travels evenly in dioptres, from infinity (0) to the nearest distance (1).
double focus_distance_mm(std::int64_t focus_absolute) {
  const double near =
      static_cast<double>(focus_absolute) / static_cast<double>(focus_range.maximum);
  return near > 0.0 ? nearest_focus_mm / near : 1e9;
}

std::int64_t focus_absolute(double distance_mm) {
  const double near = std::clamp(nearest_focus_mm / distance_mm, 0.0, 1.0);
  return std::llround(near * static_cast<double>(focus_range.maximum));
}

bool is_nth(std::int64_t count, const std::optional<int>& n) { return n && count % *n == 0; }

/// The table's angles during an exposure, in whole millionths of a degree: far finer than any
/// picture shows, and the same for every exposure of a table at rest.
using ExposureAngles = std::array<std::int64_t, angles_per_exposure>;
constexpr double angle_step_deg = 1e-6;

/// The light of the exposure rendered last, and all that it depends on.
struct RenderedLight {
  std::shared_ptr<const PlacedScene> scene;
  double focus_distance_mm = 0.0;
  ExposureAngles angles{};
  ImageF radiance;
};

}  // namespace

Result<void> SimulatedCameraOptions::validate() const {
  if (const auto sound = optics.validate(); !sound) return sound;
  if (const auto sound = sensor.validate(); !sound) return sound;
  if (const auto sound = render.validate(); !sound) return sound;
  const auto bad = [&](const char* option, const std::string& what) {
    return fail(ErrorKind::bad_input, fmt::format("simulated camera {}, {}", serial, option), what);
  };
  if (frame_period.count() <= 0) return bad("frame_period", "must be positive");
  if (default_exposure.count() < exposure_range.minimum ||
      default_exposure.count() > exposure_range.maximum) {
    return bad("default_exposure",
               fmt::format("must be {} to {} us", exposure_range.minimum, exposure_range.maximum));
  }
  for (const auto& n :
       {faults.times_out_every_nth, faults.drops_every_nth, faults.corrupt_every_nth}) {
    if (n && *n < 1) return bad("faults", "\"every nth\" counts from 1");
  }
  if (faults.unplugged_after_frames && *faults.unplugged_after_frames < 0) {
    return bad("faults", "unplugged_after_frames must not be negative");
  }
  return {};
}

struct SimulatedCamera::State {
  std::shared_ptr<const SimulatedScene> scene;
  SimulatedCameraOptions options;
  std::function<double(Instant)> true_table_angle_deg;
  Clock& clock;
  PreparedOptics optics;

  ExposureSettings settings;
  std::int64_t focus = 0;

  bool plugged = true;
  bool streaming = true;
  Instant stream_start;            ///< beginning of frame 0
  std::int64_t next_sequence = 0;  ///< frames before it were handed out or missed
  std::int64_t requests = 0;
  std::int64_t handed_out = 0;  ///< since it was first opened
  RenderedLight rendered = {};

  std::string path() const { return "simulated:" + options.serial; }
  tl::unexpected<Error> hardware(const std::string& what, const std::string& advice) const {
    return fail(ErrorKind::hardware, path(), what, advice);
  }
  /// An exposure longer than the frame period slows the stream down, as it does on a real camera.
  nanoseconds period() const {
    return std::max<nanoseconds>(options.frame_period, settings.exposure + readout);
  }
  Instant exposure_start(std::int64_t sequence) const { return stream_start + sequence * period(); }
  /// The first frame whose exposure begins at or after the moment.
  std::int64_t first_from(Instant moment) const {
    if (moment <= stream_start) return 0;
    const nanoseconds late = moment - stream_start;
    return (late + period() - nanoseconds{1}) / period();
  }
  void restart_stream() {
    stream_start = clock.now();
    next_sequence = 0;
    streaming = true;
  }
  void pull_cable() {
    plugged = false;
    streaming = false;
  }
  tl::unexpected<Error> unplugged() const {
    return hardware("is unplugged", "check its cable, then open it again");
  }

  /// Noise-free light on the sensor. Table, scene and focus mostly stand still from one frame to
  /// the next; then it is the last frame's. The samples' pattern depends on the angle, not on the
  /// frame, so that what was rendered before is what would be rendered now.
  const ImageF& light(const ExposureAngles& angles);
  Frame photograph(std::int64_t sequence);
};

const ImageF& SimulatedCamera::State::light(const ExposureAngles& angles) {
  std::shared_ptr<const PlacedScene> placed = scene->placed();
  const double focus_distance_mm = optics.optics().focus_distance_mm;
  if (rendered.scene == placed && rendered.focus_distance_mm == focus_distance_mm &&
      rendered.angles == angles) {
    return rendered.radiance;
  }
  std::array<double, angles_per_exposure> angles_deg{};
  std::ranges::transform(angles, angles_deg.begin(), [](std::int64_t steps) {
    return static_cast<double>(steps) * angle_step_deg;
  });
  RenderOptions render = options.render;
  render.seed = mix(options.render.seed, static_cast<std::uint64_t>(angles.front()));
  ImageF radiance = render_radiance(*placed, optics, angles_deg, render);
  if (options.faults.overexposed) {
    for (float& value : radiance.pixels) value *= overexposure;
  }
  rendered = {std::move(placed), focus_distance_mm, angles, std::move(radiance)};
  return rendered.radiance;
}

Frame SimulatedCamera::State::photograph(std::int64_t sequence) {
  const Instant start = exposure_start(sequence);
  ExposureAngles angles{};
  for (int i = 0; i < angles_per_exposure; ++i) {
    const double angle_deg = true_table_angle_deg(start + nanoseconds(settings.exposure) * i /
                                                              (angles_per_exposure - 1));
    angles[static_cast<std::size_t>(i)] = std::llround(angle_deg / angle_step_deg);
  }
  const std::uint64_t noise_seed =
      mix(mix(options.render.seed, static_cast<std::uint64_t>(sequence)), 1);
  Frame frame;
  frame.image =
      develop(light(angles), options.sensor, settings, noise_seed, options.render.threads);
  frame.exposure_start = start;
  frame.sequence = static_cast<std::uint32_t>(sequence);
  frame.exposure = settings.exposure;
  return frame;
}

SimulatedCamera::SimulatedCamera(std::unique_ptr<State> state) : state_(std::move(state)) {}
SimulatedCamera::~SimulatedCamera() = default;

Result<std::unique_ptr<SimulatedCamera>> SimulatedCamera::open(
    std::shared_ptr<const SimulatedScene> scene, const SimulatedCameraOptions& options,
    std::function<double(Instant)> true_table_angle_deg, Clock& clock) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (options.faults.dead) {
    return fail(ErrorKind::hardware, "simulated:" + options.serial, "there is no such camera",
                "check that it is plugged in and has power");
  }
  auto optics = PreparedOptics::prepare(options.optics, options.render.threads);
  if (!optics) return forward(optics);
  auto state = std::unique_ptr<State>(new State{std::move(scene),
                                                options,
                                                std::move(true_table_angle_deg),
                                                clock,
                                                *std::move(optics),
                                                {},
                                                0,
                                                true,
                                                true,
                                                clock.now(),
                                                0,
                                                0,
                                                0});
  state->settings.exposure = options.default_exposure;
  state->settings.white_balance_k = options.sensor.light_temperature_k;
  state->focus = focus_absolute(options.optics.focus_distance_mm);
  return std::unique_ptr<SimulatedCamera>(new SimulatedCamera(std::move(state)));
}

CameraDescription SimulatedCamera::description() const {
  const Lens& lens = state_->options.optics.lens;
  return {"simulated", "Simulated camera", state_->options.serial, state_->path(),
          fmt::format("{} {}x{}", state_->options.sensor.grey ? "GREY" : "RGB3", lens.width,
                      lens.height)};
}

Result<Frame> SimulatedCamera::frame_after(Instant not_before, std::chrono::milliseconds timeout,
                                           std::stop_token stop) {
  State& s = *state_;
  if (stop.stop_requested()) return fail(ErrorKind::cancelled, s.path(), "stopped");
  if (!s.streaming) return s.unplugged();
  if (s.options.faults.unplugged_after_frames &&
      s.handed_out >= *s.options.faults.unplugged_after_frames) {
    s.pull_cable();
    return s.unplugged();
  }
  const Instant deadline = s.clock.now() + timeout;
  ++s.requests;
  const bool nothing_comes =
      s.options.faults.silent || is_nth(s.requests, s.options.faults.times_out_every_nth);

  // Nothing that began before now is waiting anywhere: a frame is exposed for this request.
  std::int64_t sequence =
      std::max(s.next_sequence, s.first_from(std::max(not_before, s.clock.now())));
  while (is_nth(sequence + 1, s.options.faults.drops_every_nth) ||
         is_nth(sequence + 1, s.options.faults.corrupt_every_nth)) {
    ++sequence;
    // With n = 1 no frame is ever good.
    if (s.exposure_start(sequence) > deadline) break;
  }
  const Instant ready = s.exposure_start(sequence) + s.settings.exposure + readout;
  if (nothing_comes || ready > deadline) {
    if (!s.clock.sleep_until(deadline, stop)) {
      return fail(ErrorKind::cancelled, s.path(), "stopped");
    }
    return s.hardware(fmt::format("sent no good frame within {} ms", timeout.count()),
                      "check its cable and its USB port, then open it again");
  }
  if (!s.clock.sleep_until(ready, stop)) return fail(ErrorKind::cancelled, s.path(), "stopped");
  s.next_sequence = sequence + 1;
  ++s.handed_out;
  return s.photograph(sequence);
}

Result<std::vector<CameraControl>> SimulatedCamera::controls() {
  if (!state_->streaming) return state_->unplugged();
  const auto control = [](const ControlRange& range, std::int64_t value) {
    return CameraControl{range.name,          range.minimum, range.maximum, range.step,
                         range.default_value, value,         false};
  };
  const ExposureSettings& settings = state_->settings;
  return std::vector<CameraControl>{
      control(exposure_range, settings.exposure.count()),
      control(gain_range, std::llround(100.0 * settings.gain)),
      control(white_balance_range, settings.white_balance_k),
      control(focus_range, state_->focus),
  };
}

Result<std::vector<LockedSetting>> SimulatedCamera::lock(const CameraSettings& settings) {
  State& s = *state_;
  if (const auto sound = check_settings(settings); !sound) return forward(sound);
  if (!s.streaming) return s.unplugged();
  std::vector<LockedSetting> locked;
  const auto set = [&](const ControlRange& range, std::int64_t asked) {
    locked.push_back({range.name, asked, range.nearest(asked)});
    return locked.back().in_force;
  };
  if (settings.exposure) {
    // A change of the frame period must not renumber the frames that have passed.
    const std::int64_t passed = std::max(s.next_sequence, s.first_from(s.clock.now()));
    const Instant next_start = s.exposure_start(passed);
    const std::int64_t in_force = set(exposure_range, settings.exposure->count());
    if (s.options.faults.ignores_exposure) {
      locked.back().in_force = s.settings.exposure.count();
    } else {
      s.settings.exposure = microseconds{in_force};
    }
    s.stream_start = next_start - passed * s.period();
  }
  if (settings.gain) {
    s.settings.gain =
        static_cast<double>(set(gain_range, std::llround(100.0 * *settings.gain))) / 100.0;
  }
  if (settings.white_balance_k) {
    s.settings.white_balance_k =
        static_cast<int>(set(white_balance_range, *settings.white_balance_k));
  }
  if (settings.focus) {
    s.focus =
        set(focus_range, std::llround(*settings.focus * static_cast<double>(focus_range.maximum)));
    s.optics.set_focus_distance_mm(focus_distance_mm(s.focus));
  }
  return locked;
}

Result<void> SimulatedCamera::reopen() {
  if (!state_->plugged) return state_->unplugged();
  state_->restart_stream();
  return {};
}

void SimulatedCamera::unplug() { state_->pull_cable(); }

void SimulatedCamera::replug() {
  state_->plugged = true;
  state_->options.faults.unplugged_after_frames.reset();
}

const CameraOptics& SimulatedCamera::optics() const { return state_->optics.optics(); }

}  // namespace skullstation
