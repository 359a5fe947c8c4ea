#include "capture/scan/scan_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <numeric>
#include <utility>

#include "capture/scan/image_metadata.h"
#include "capture/scan/scan_setup.h"
#include "capture/scan/session_recorder.h"
#include "capture/scan/space_reserve.h"
#include "core/session/image_file.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

/// However a scan ends, the motor's current and the lights go off.
class StationRest {
 public:
  explicit StationRest(StationHardware& hardware) : hardware_(hardware) {}
  ~StationRest() {
    if (!done_) static_cast<void>(enter());  // an error or an exception is under way already
  }
  StationRest(const StationRest&) = delete;
  StationRest& operator=(const StationRest&) = delete;

  Result<void> enter() {
    done_ = true;
    Result<void> released = hardware_.turntable->release();
    Result<void> dark = hardware_.lights->set(false);
    if (!released) return released;
    return dark;
  }

 private:
  StationHardware& hardware_;
  bool done_ = false;
};

struct FrameSize {
  int width = 0;
  int height = 0;
  int channels = 0;
  bool operator==(const FrameSize&) const = default;
};

FrameSize size_of(const Image8& image) { return {image.width, image.height, image.channels}; }

/// A size that no file of this image exceeds (but for JPEG of pure noise): PNG stores what it
/// can't compress. The rest is EXIF and the session file, twice, as it is rewritten.
std::uint64_t bytes_bound(const FrameSize& size, PhotographFormat format) {
  const auto raw = static_cast<std::uint64_t>(size.width) *
                   static_cast<std::uint64_t>(size.height) *
                   static_cast<std::uint64_t>(size.channels);
  constexpr std::uint64_t metadata = std::uint64_t{64} * 1024;
  return (format == PhotographFormat::png ? raw + raw / 100 : raw / 2) + metadata;
}

class Scan {
 public:
  Scan(const ScanOptions& options, const ScanStation& station, SessionRecorder& recorder,
       const Progress& progress)
      : options_(options), station_(station), recorder_(recorder), progress_(progress) {
    for (const ScanCamera& camera : station.cameras) cameras_.emplace(camera.id, &camera);
  }

  Result<void> run(const fs::path& folder);
  int taken() const { return taken_; }
  int retries() const { return retries_; }

 private:
  std::vector<PlannedView> missing_views(const ScanStop& stop) const;
  std::uint64_t bytes_of_missing_views() const;
  Result<void> look_through_all_cameras();
  Result<void> prepare_pass(int pass);
  Result<void> take_pass(int pass);
  Result<void> take_view(const PlannedView& planned, Instant settled);
  Result<void> record(const PlannedView& planned, const ScanCamera& camera, const Frame& frame,
                      ViewQuality quality);
  Result<Frame> grab(const ScanCamera& camera, Instant not_before);
  Result<void> check_interlock() const;
  Result<void> sleep_until(Instant deadline);
  tl::unexpected<Error> stopped() const;
  std::vector<double> accepted_sharpness(const std::string& camera) const;
  const ScanCamera& camera_of(const PlannedView& view) const {
    return *cameras_.at(options_.plan.rings[static_cast<std::size_t>(view.ring)].camera);
  }

  const ScanOptions& options_;
  const ScanStation& station_;
  SessionRecorder& recorder_;
  const Progress& progress_;
  std::map<std::string, const ScanCamera*> cameras_;
  std::map<std::string, FrameSize> frame_sizes_;
  std::optional<SpaceReserve> reserve_;
  int taken_ = 0;
  int retries_ = 0;
};

Result<void> Scan::run(const fs::path& folder) {
  if (Result<void> safe = check_interlock(); !safe) return safe;
  if (Result<void> lit = station_.hardware.lights->set(true); !lit) return lit;
  if (Result<void> seen = look_through_all_cameras(); !seen) return seen;
  Result<SpaceReserve> reserve = SpaceReserve::take(folder, bytes_of_missing_views());
  if (!reserve) return forward(reserve);
  reserve_.emplace(std::move(*reserve));
  if (Result<void> begun = recorder_.begin(); !begun) return begun;

  // The placement that still exists is used up first.
  std::vector<int> passes(static_cast<std::size_t>(options_.plan.passes));
  std::iota(passes.begin(), passes.end(), 0);
  std::stable_partition(passes.begin(), passes.end(),
                        [&](int pass) { return pass == recorder_.current_pass(); });
  for (const int pass : passes) {
    if (Result<void> done = take_pass(pass); !done) return done;
  }
  return {};
}

std::vector<PlannedView> Scan::missing_views(const ScanStop& stop) const {
  std::vector<PlannedView> missing;
  std::ranges::copy_if(stop.views, std::back_inserter(missing),
                       [&](const PlannedView& view) { return !recorder_.recorded(view); });
  return missing;
}

std::uint64_t Scan::bytes_of_missing_views() const {
  std::uint64_t bytes = 0;
  for (const PlannedView& view : planned_views(options_.plan)) {
    if (recorder_.recorded(view)) continue;
    bytes += bytes_bound(frame_sizes_.at(camera_of(view).id), options_.plan.image_format);
  }
  return bytes;
}

/// A camera that is missing, or gives another size than it was calibrated for, is noticed before
/// anything moves.
Result<void> Scan::look_through_all_cameras() {
  progress_.report(0.0, "looking through the cameras");
  for (const SessionPlan::Ring& ring : options_.plan.rings) {
    const ScanCamera& camera = *cameras_.at(ring.camera);
    const Result<Frame> frame = grab(camera, station_.clock.now());
    if (!frame) return forward(frame);
    const FrameSize size = size_of(frame->image);
    if (camera.lens && (camera.lens->width != size.width || camera.lens->height != size.height)) {
      return fail(ErrorKind::bad_input, camera.id,
                  fmt::format("was calibrated at {}x{} px and delivers {}x{}", camera.lens->width,
                              camera.lens->height, size.width, size.height),
                  "set the format it was calibrated for, or calibrate it again");
    }
    if (Result<void> same = recorder_.set_image_size(camera.id, size.width, size.height); !same) {
      return same;
    }
    frame_sizes_[camera.id] = size;
  }
  return {};
}

Result<void> Scan::prepare_pass(int pass) {
  const bool continued = recorder_.recorded_in_pass(pass) > 0;
  const bool begins_new_session =
      pass == 0 && recorder_.session().views.empty() && recorder_.replaced().empty();
  if (!begins_new_session) {
    // Hands are at the platter now: it must not be able to move.
    if (Result<void> released = station_.hardware.turntable->release(); !released) return released;
    Result<void> placed = station_.ask_for_placement({pass, continued}, progress_.stop);
    if (!placed) return placed;
    // The door had to be opened. The emergency stop, in contrast, ends the scan.
    Interlock& interlock = *station_.hardware.interlock;
    if (interlock.tripped() && interlock.reason() == "door open") {
      if (Result<void> closed = interlock.reset(); !closed) return closed;
    }
  }
  if (Result<void> safe = check_interlock(); !safe) return safe;
  Result<void> homed = station_.hardware.turntable->home(progress_.stop);
  if (Result<void> safe = check_interlock(); !safe) return safe;
  return homed;
}

Result<void> Scan::take_pass(int pass) {
  const std::vector<ScanStop> stops = stops_of_pass(options_.plan, pass);
  int views_in_pass = 0;
  int missing_in_pass = 0;
  for (const ScanStop& stop : stops) {
    views_in_pass += static_cast<int>(stop.views.size());
    missing_in_pass += static_cast<int>(missing_views(stop).size());
  }
  if (missing_in_pass == 0) return {};
  const double all_views = static_cast<double>(views_in_pass) * options_.plan.passes;
  const auto report = [&](std::string_view stage) {
    progress_.report(static_cast<double>(recorder_.session().views.size()) / all_views, stage);
  };
  report(fmt::format("pass {} of {}, preparing", pass + 1, options_.plan.passes));
  if (Result<void> prepared = prepare_pass(pass); !prepared) return prepared;

  for (const ScanStop& stop : stops) {
    const std::vector<PlannedView> missing = missing_views(stop);
    if (missing.empty()) continue;
    Result<void> moved = station_.hardware.turntable->move_to(stop.table_angle_deg, progress_.stop);
    if (Result<void> safe = check_interlock(); !safe) return safe;
    if (!moved) return moved;
    const Instant settled = station_.clock.now() + options_.settle_time;
    for (const PlannedView& view : missing) {
      report(fmt::format("pass {} of {}, view {} of {}", pass + 1, options_.plan.passes,
                         recorder_.recorded_in_pass(pass) + 1, views_in_pass));
      if (Result<void> taken = take_view(view, settled); !taken) return taken;
    }
  }
  return {};
}

Result<void> Scan::take_view(const PlannedView& planned, Instant settled) {
  const ScanCamera& camera = camera_of(planned);
  for (int attempt = 1;; ++attempt) {
    if (Result<void> slept = sleep_until(settled); !slept) return slept;
    const Result<Frame> earlier = grab(camera, settled);
    if (Result<void> safe = check_interlock(); !safe) return safe;
    if (!earlier) return forward(earlier);
    const Result<Frame> frame = grab(camera, earlier->exposure_start + options_.motion_interval);
    if (Result<void> safe = check_interlock(); !safe) return safe;
    if (!frame) return forward(frame);
    for (const Frame& taken : {std::cref(*earlier), std::cref(*frame)}) {
      if (size_of(taken.image) != frame_sizes_.at(camera.id)) {
        return fail(ErrorKind::hardware, camera.id,
                    fmt::format("changed its format during the scan: {}x{} px", taken.image.width,
                                taken.image.height),
                    "close other programs that use the camera and start the scan again");
      }
    }
    ViewQuality quality = measure_view(frame->image, &earlier->image, options_.board);
    quality.attempts = attempt;
    quality.rejected = failed_gate(quality, options_.gates, accepted_sharpness(camera.id),
                                   options_.board.has_value());
    if (!quality.rejected || attempt >= options_.max_attempts) {
      return record(planned, camera, *frame, std::move(quality));
    }
    ++retries_;
    // A tall skull may rock for longer than was thought.
    settled = station_.clock.now() + options_.settle_time * (attempt + 1);
  }
}

Result<void> Scan::record(const PlannedView& planned, const ScanCamera& camera, const Frame& frame,
                          ViewQuality quality) {
  const UtcTime captured =
      station_.clock.utc_now() -
      std::chrono::duration_cast<UtcTime::duration>(station_.clock.now() - frame.exposure_start);
  const CameraDescription device = camera.camera.description();
  ImageMetadata metadata;
  metadata.description =
      fmt::format("case {}, pass {}, camera {}, table at {:.4f} deg", options_.case_number,
                  planned.pass, camera.id, planned.table_angle_deg);
  metadata.camera_model = device.model;
  metadata.camera_serial = device.serial;
  metadata.captured = captured;
  metadata.exposure = frame.exposure;
  metadata.focal_length_mm = camera.focal_length_mm;
  if (camera.lens) metadata.focal_length_35mm = camera.lens->fx / camera.lens->width * 36.0;
  const Result<std::string> file =
      with_metadata(options_.plan.image_format == PhotographFormat::png
                        ? encode_png(frame.image)
                        : encode_jpeg(frame.image, options_.plan.jpeg_quality),
                    metadata);
  if (!file) return forward(file);

  SessionView view;
  view.image = planned.image;
  view.camera = camera.id;
  view.pass = planned.pass;
  view.table_angle_deg = station_.hardware.turntable->angle_deg().value_or(planned.table_angle_deg);
  view.exposure = frame.exposure;
  view.captured = to_iso8601(captured);
  view.quality = std::move(quality);
  const std::uint64_t this_view =
      bytes_bound(frame_sizes_.at(camera.id), options_.plan.image_format);
  reserve_->shrink_to(bytes_of_missing_views() - this_view);
  if (Result<void> recorded = recorder_.record(std::move(view), *file); !recorded) return recorded;
  ++taken_;
  return {};
}

/// A camera that fails is opened anew once; if that doesn't help, the scan ends with its error.
Result<Frame> Scan::grab(const ScanCamera& camera, Instant not_before) {
  Result<Frame> frame =
      camera.camera.frame_after(not_before, options_.frame_timeout, progress_.stop);
  if (frame || frame.error().kind != ErrorKind::hardware) return frame;
  if (camera.camera.reopen()) {  // else the first error says what happened
    frame = camera.camera.frame_after(std::max(not_before, station_.clock.now()),
                                      options_.frame_timeout, progress_.stop);
  }
  if (frame) return frame;
  return forward(fmt::format("camera \"{}\"", camera.id), frame);
}

Result<void> Scan::check_interlock() const {
  const Interlock& interlock = *station_.hardware.interlock;
  if (!interlock.tripped()) return {};
  return fail(ErrorKind::hardware, "interlock", interlock.reason(),
              "make the station safe and reset it");
}

Result<void> Scan::sleep_until(Instant deadline) {
  if (!station_.clock.sleep_until(deadline, progress_.stop)) return stopped();
  return {};
}

tl::unexpected<Error> Scan::stopped() const {
  return fail(ErrorKind::cancelled, "scan", "stopped on request");
}

std::vector<double> Scan::accepted_sharpness(const std::string& camera) const {
  std::vector<double> values;
  for (const SessionView& view : recorder_.session().views) {
    if (view.camera == camera && view.quality && !view.quality->rejected) {
      values.push_back(view.quality->sharpness);
    }
  }
  return values;
}

/// Tells whoever reads the error that nothing is lost.
Error with_way_on(Error error, const SessionRecorder& recorder, int planned) {
  const std::size_t recorded = recorder.session().views.size();
  if (recorded == 0) return error;
  if (!error.advice.empty()) error.advice += "; ";
  error.advice += fmt::format("{} of {} views are recorded: the same scan started again goes on",
                              recorded, planned);
  return error;
}

}  // namespace

Result<ScanReport> run_scan(const ScanOptions& options, const ScanStation& station,
                            const fs::path& folder, const Progress& progress) {
  if (Result<void> valid = options.validate(); !valid) return forward(valid);
  if (Result<void> valid = check_cameras(options.plan, station.cameras); !valid) {
    return forward(valid);
  }
  Result<SessionRecorder> recorder = SessionRecorder::open(
      folder, wanted_session(options, station), options.plan, station.write_file, progress);
  if (!recorder) return forward(recorder);

  ScanReport report;
  report.planned = static_cast<int>(planned_views(options.plan).size());
  report.kept = static_cast<int>(recorder->session().views.size());
  report.replaced = recorder->replaced();
  if (!recorder->complete()) {
    StationRest rest(station.hardware);
    Scan scan(options, station, *recorder, progress);
    if (Result<void> done = scan.run(folder); !done) {
      return tl::unexpected(with_way_on(done.error(), *recorder, report.planned));
    }
    if (Result<void> resting = rest.enter(); !resting) return forward(resting);
    report.taken = scan.taken();
    report.retries = scan.retries();
  }
  for (const SessionView& view : recorder->session().views) {
    if (view.quality && view.quality->rejected) {
      report.rejected.push_back(fmt::format("{}: {}", view.image, *view.quality->rejected));
    }
  }
  progress.report(1.0, "scan complete");
  return report;
}

}  // namespace skullstation
