#include "capture/simulation/simulated_camera.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <stdexcept>

#include "core/session/charuco_board.h"
#include "firmware_io/simulated_station.h"
#include "tests/unit/simulation/test_scene.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// A box on a board, a camera, and a table that turns as the test says.
class Station {
 public:
  explicit Station(const std::function<void(SimulatedCameraOptions&)>& change = {},
                   std::shared_ptr<SimulatedScene> scene = shared_scene())
      : scene_(std::move(scene)) {
    SimulatedCameraOptions options = camera_options();
    if (change) change(options);
    auto camera = SimulatedCamera::open(
        scene_, options,
        [this](Instant at) { return angle_at(std::chrono::duration<double>(at - start_).count()); },
        clock_);
    if (!camera) throw std::runtime_error(camera.error().message());
    camera_ = *std::move(camera);
  }

  static SimulatedCameraOptions camera_options() {
    SimulatedCameraOptions options;
    options.optics = testing::small_optics(25.0);
    options.optics.aperture_mm = 1.2;
    options.render.threads = 2;
    return options;
  }
  static std::shared_ptr<SimulatedScene> new_scene() {
    const TriangleMesh box = testing::box_mesh({90.0, 60.0, 80.0});
    return testing::make_scene(box, rest_on_table(box, Eigen::Quaterniond::Identity()),
                               testing::board_room());
  }
  static std::shared_ptr<SimulatedScene> shared_scene() {
    static const std::shared_ptr<SimulatedScene> scene = new_scene();
    return scene;
  }

  SimulatedCamera& camera() { return *camera_; }
  SimulatedScene& scene() { return *scene_; }
  SimulatedClock& clock() { return clock_; }
  Result<Frame> frame(std::chrono::milliseconds timeout = 10s) {
    return camera_->frame_after(clock_.now(), timeout, {});
  }
  Frame good_frame() {
    auto frame = this->frame();
    if (!frame) throw std::runtime_error(frame.error().message());
    return *std::move(frame);
  }

  std::function<double(double seconds)> angle_at = [](double) { return 0.0; };

 private:
  std::shared_ptr<SimulatedScene> scene_;
  SimulatedClock clock_;
  Instant start_ = clock_.now();
  std::unique_ptr<SimulatedCamera> camera_;
};

double mean_of(const Image8& image) {
  return std::accumulate(image.pixels.begin(), image.pixels.end(), 0.0) /
         static_cast<double>(image.pixels.size());
}

double rms_difference(const Image8& a, const Image8& b) {
  double sum = 0.0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) {
    sum += std::pow(static_cast<double>(a.pixels[i]) - b.pixels[i], 2);
  }
  return std::sqrt(sum / static_cast<double>(a.pixels.size()));
}

// ---- frames that show the same ----

TEST(SimulatedCamera, AFrameIsTheSameWhateverWasPhotographedBefore) {
  // Angle and frame number of each picture; some show what the one before showed, some a table
  // that has moved and come back.
  const double angles_deg[] = {30.0, 30.0, 30.0, 47.5, 30.0, 30.0};
  Station busy;
  std::vector<Frame> frames;
  for (const double angle_deg : angles_deg) {
    busy.angle_at = [angle_deg](double) { return angle_deg; };
    frames.push_back(busy.good_frame());
  }
  for (std::size_t i = 0; i < frames.size(); ++i) {
    Station fresh;
    const double angle_deg = angles_deg[i];
    fresh.angle_at = [angle_deg](double) { return angle_deg; };
    const auto frame = fresh.camera().frame_after(frames[i].exposure_start, 10s, {});
    ASSERT_TRUE(frame) << frame.error().message();
    ASSERT_EQ(frame->sequence, frames[i].sequence);
    EXPECT_TRUE(frame->image == frames[i].image) << "frame " << frame->sequence;
  }
}

TEST(SimulatedCamera, EveryFrameHasNoiseOfItsOwn) {
  Station station;
  const Frame first = station.good_frame();
  const Frame second = station.good_frame();
  const double difference = rms_difference(first.image, second.image);
  EXPECT_GT(difference, 0.5);
  EXPECT_LT(difference, 5.0);
}

TEST(SimulatedCamera, AChangeSmallerThanAMillionthOfADegreeIsNone) {
  Station still;
  still.angle_at = [](double) { return 30.0; };
  Station trembling;
  trembling.angle_at = [](double seconds) { return 30.0 + 3e-7 * std::sin(1000.0 * seconds); };
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(still.good_frame().image == trembling.good_frame().image);
}

/// Photographs, makes a change, photographs again: the second picture must differ from the first
/// and be the one that a camera takes which never saw the first.
void expect_shows(double least_rms, const std::function<void(Station&)>& change) {
  Station station({}, Station::new_scene());
  const Frame before = station.good_frame();
  change(station);
  const Frame after = station.good_frame();
  EXPECT_GT(rms_difference(before.image, after.image), least_rms);

  Station fresh({}, Station::new_scene());
  change(fresh);
  const auto frame = fresh.camera().frame_after(after.exposure_start, 10s, {});
  ASSERT_TRUE(frame) << frame.error().message();
  ASSERT_EQ(frame->sequence, after.sequence);
  EXPECT_TRUE(frame->image == after.image);
}

TEST(SimulatedCamera, WhateverIsChangedBetweenTwoFramesShows) {
  {
    SCOPED_TRACE("focus");
    expect_shows(4.0, [](Station& s) { ASSERT_TRUE(s.camera().lock({.focus = 1.0})); });
  }
  {
    SCOPED_TRACE("exposure");
    expect_shows(4.0, [](Station& s) { ASSERT_TRUE(s.camera().lock({.exposure = 2ms})); });
  }
  {
    SCOPED_TRACE("white balance");
    expect_shows(2.0, [](Station& s) { ASSERT_TRUE(s.camera().lock({.white_balance_k = 3200})); });
  }
  {
    SCOPED_TRACE("table angle");
    expect_shows(4.0, [](Station& s) { s.angle_at = [](double) { return 20.0; }; });
  }
  {
    SCOPED_TRACE("specimen");
    expect_shows(4.0, [](Station& s) { s.scene().set_specimen_pose(std::nullopt); });
  }
  {
    SCOPED_TRACE("board");
    expect_shows(4.0, [](Station& s) { s.scene().set_board_pose(rotation_about_z(10.0)); });
  }
}

// ---- faults ----

std::function<void(SimulatedCameraOptions&)> with(const SimulatedCameraFaults& faults) {
  return [faults](SimulatedCameraOptions& options) { options.faults = faults; };
}

void expect_hardware_error(const Result<Frame>& frame, const std::string& what) {
  ASSERT_FALSE(frame);
  EXPECT_EQ(frame.error().kind, ErrorKind::hardware);
  EXPECT_EQ(frame.error().where, "simulated:SIM-1");
  EXPECT_THAT(frame.error().what, HasSubstr(what));
  EXPECT_FALSE(frame.error().advice.empty());
}

TEST(SimulatedCameraFaults, ADeadCameraCannotBeOpened) {
  SimulatedCameraOptions options = Station::camera_options();
  options.faults.dead = true;
  SimulatedClock clock;
  const auto camera = SimulatedCamera::open(
      Station::shared_scene(), options, [](Instant) { return 0.0; }, clock);
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().kind, ErrorKind::hardware);
  EXPECT_THAT(camera.error().message(), HasSubstr("SIM-1"));
}

TEST(SimulatedCameraFaults, TheCableComesOffAfterSoManyFramesAndIsPutBackOnce) {
  Station station(with({.unplugged_after_frames = 2}));
  ASSERT_TRUE(station.frame());
  ASSERT_TRUE(station.frame());
  expect_hardware_error(station.frame(), "unplugged");
  EXPECT_FALSE(station.camera().reopen());
  EXPECT_FALSE(station.camera().controls());
  EXPECT_FALSE(station.camera().lock({.gain = 2.0}));
  station.camera().replug();
  expect_hardware_error(station.frame(), "unplugged");
  ASSERT_TRUE(station.camera().reopen());
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(station.frame());
}

TEST(SimulatedCameraFaults, ASilentCameraKeepsTheCallerForAsLongAsHeWaits) {
  Station station(with({.silent = true}));
  const Instant before = station.clock().now();
  expect_hardware_error(station.frame(2500ms), "2500 ms");
  EXPECT_EQ(station.clock().now() - before, 2500ms);
}

TEST(SimulatedCameraFaults, EveryThirdRequestTimesOut) {
  Station station(with({.times_out_every_nth = 3}));
  for (int request = 1; request <= 7; ++request) {
    EXPECT_EQ(station.frame().has_value(), request % 3 != 0) << request;
  }
}

TEST(SimulatedCameraFaults, LostAndDamagedFramesNeverReachTheCaller) {
  for (const SimulatedCameraFaults& faults : {SimulatedCameraFaults{.drops_every_nth = 3},
                                              SimulatedCameraFaults{.corrupt_every_nth = 3}}) {
    Station station(with(faults));
    std::vector<std::uint32_t> numbers;
    Image8 last;
    for (int i = 0; i < 5; ++i) {
      const Frame frame = station.good_frame();
      numbers.push_back(frame.sequence);
      last = frame.image;
    }
    for (const std::uint32_t number : numbers) EXPECT_NE(number % 3, 2U);
    // The picture after a lost one is no other than without the fault.
    Station sound;
    const auto frame = sound.camera().frame_after(
        sound.clock().now() + std::chrono::nanoseconds(66'667us) * numbers.back(), 10s, {});
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->sequence, numbers.back());
    EXPECT_TRUE(frame->image == last);
  }
}

TEST(SimulatedCameraFaults, WhereNoFrameIsGoodTheCallerGetsATimeOut) {
  expect_hardware_error(Station(with({.drops_every_nth = 1})).frame(500ms), "500 ms");
  expect_hardware_error(Station(with({.corrupt_every_nth = 1})).frame(500ms), "500 ms");
  expect_hardware_error(Station(with({.drops_every_nth = 2, .corrupt_every_nth = 1})).frame(500ms),
                        "500 ms");
}

TEST(SimulatedCameraFaults, OverexposureBurnsTheHighlights) {
  const auto burnt_share = [](const Image8& image) {
    return static_cast<double>(std::ranges::count(image.pixels, 255)) /
           static_cast<double>(image.pixels.size());
  };
  const Image8 sound = Station().good_frame().image;
  Station burnt(with({.overexposed = true}));
  EXPECT_LT(burnt_share(sound), 0.01);
  EXPECT_GT(burnt_share(burnt.good_frame().image), 0.1);
  // As much light in every picture, also where the table has not moved.
  EXPECT_NEAR(mean_of(burnt.good_frame().image), mean_of(burnt.good_frame().image), 0.2);
}

TEST(SimulatedCameraFaults, AnExposureThatIsIgnoredIsReportedAsItIs) {
  Station station(with({.ignores_exposure = true}));
  const Frame before = station.good_frame();
  const auto locked = station.camera().lock({.exposure = 2ms});
  ASSERT_TRUE(locked);
  ASSERT_EQ(locked->size(), 1U);
  EXPECT_EQ(locked->front().asked, 2000);
  EXPECT_EQ(locked->front().in_force, 8000);
  const Frame after = station.good_frame();
  EXPECT_EQ(after.exposure, 8000us);
  EXPECT_NEAR(mean_of(after.image), mean_of(before.image), 0.2);
}

TEST(SimulatedCameraFaults, SlipOfTheTurntableReachesThePixels) {
  SimulatedClock clock;
  SimulatedFaults faults;
  faults.slip_fraction = 0.02;
  SimulatedStation table(TurntableConfig{}, faults, clock, 3);
  const StationHardware hardware = table.hardware();
  ASSERT_TRUE(hardware.turntable->home({}));
  ASSERT_TRUE(hardware.turntable->move_to(90.0, {}));
  ASSERT_TRUE(clock.sleep_for(2s, {}));
  const double true_deg = table.true_table_angle_deg(clock.now());
  EXPECT_NEAR(*hardware.turntable->angle_deg(), 90.0, 0.05);
  EXPECT_GT(std::abs(std::remainder(true_deg - 90.0, 360.0)), 1.0);

  SimulatedCameraOptions options = Station::camera_options();
  options.optics.lens =
      Lens::from_params(320, 240, LensModel::pinhole, {400.0, 400.0, 160.0, 120.0});
  options.optics.camera_from_station = camera_on_ring({0.0, 0.0, 0.0}, 650.0, 60.0);
  const SceneOptions room = testing::board_room();
  const auto camera = SimulatedCamera::open(
      testing::make_scene({}, {}, room), options,
      [&table](Instant at) { return table.true_table_angle_deg(at); }, clock);
  ASSERT_TRUE(camera);
  const auto frame = (*camera)->frame_after(clock.now(), 1s, {});
  ASSERT_TRUE(frame);
  const std::vector<BoardCorner> corners = detect_board(frame->image, *room.board);
  ASSERT_GE(corners.size(), 20U);
  double off_true_px = 0.0;
  double off_commanded_px = 0.0;
  for (const BoardCorner& corner : corners) {
    const auto error_px = [&](double angle_deg) {
      return (testing::project(options.optics, angle_deg, room.board->corner(corner.id)) -
              corner.position_px)
          .norm();
    };
    off_true_px = std::max(off_true_px, error_px(true_deg));
    off_commanded_px = std::max(off_commanded_px, error_px(90.0));
  }
  EXPECT_LT(off_true_px, 0.3);
  EXPECT_GT(off_commanded_px, 2.0);
}

}  // namespace
}  // namespace skullstation
