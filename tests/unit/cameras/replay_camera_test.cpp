#include "capture/cameras/replay_camera.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/file.h"
#include "core/session/image_file.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using testing::TemporaryFolder;

class ReplayCamera : public ::testing::Test {
 protected:
  void save(const std::string& name, const Image8& image) {
    ASSERT_TRUE(write_file_durably(folder_ / name, encode_png(image)));
  }
  std::unique_ptr<Camera> open(bool loop = false) {
    const auto pictures = pictures_in(folder_.path());
    if (!pictures) return nullptr;
    auto camera = open_replay_camera({.pictures = *pictures, .loop = loop}, clock_);
    return camera ? std::move(*camera) : nullptr;
  }
  int level(Camera& camera) {
    const auto frame = camera.frame_after(clock_.now(), 1s, {});
    return frame ? frame->image.at(0, 0) : -1;
  }

  TemporaryFolder folder_;
  SimulatedClock clock_;
};

TEST_F(ReplayCamera, PicturesAreOrderedByTheNumbersInTheirNames) {
  for (const char* name :
       {"view_10.png", "view_2.PNG", "view_002b.jpg", "a.tiff", "view_1.jpeg", "notes.txt"}) {
    ASSERT_TRUE(write_file_durably(folder_ / name, "x"));
  }
  const auto pictures = pictures_in(folder_.path());
  ASSERT_TRUE(pictures);
  std::vector<std::string> names;
  for (const auto& path : *pictures) names.push_back(path.filename().string());
  EXPECT_THAT(names,
              ElementsAre("a.tiff", "view_1.jpeg", "view_2.PNG", "view_002b.jpg", "view_10.png"));
}

TEST_F(ReplayCamera, AFolderWithoutPicturesIsAnError) {
  const auto none = pictures_in(folder_.path());
  ASSERT_FALSE(none);
  EXPECT_EQ(none.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(none.error().message(),
              AllOf(HasSubstr(folder_.path().string()), HasSubstr("no PNG")));
  EXPECT_FALSE(pictures_in(folder_ / "nowhere"));
  EXPECT_FALSE(open_replay_camera({}, clock_));
}

TEST_F(ReplayCamera, ServesEachPictureOnceInOrderAndThenSaysSo) {
  for (int i = 0; i < 3; ++i)
    save(fmt::format("p{}.png", i), Image8(4, 3, 1, static_cast<std::uint8_t>(10 * i)));
  const auto camera = open();
  ASSERT_TRUE(camera);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(level(*camera), 10 * i);
  for (int i = 0; i < 2; ++i) {
    const auto after = camera->frame_after(clock_.now(), 1s, {});
    ASSERT_FALSE(after);
    EXPECT_EQ(after.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(after.error().message(), HasSubstr("all 3 pictures were used"));
    ASSERT_TRUE(camera->reopen());  // does not begin again
  }
}

TEST_F(ReplayCamera, LoopsIfAsked) {
  save("a.png", Image8(4, 3, 1, 1));
  save("b.png", Image8(4, 3, 1, 2));
  const auto camera = open(true);
  ASSERT_TRUE(camera);
  EXPECT_EQ(level(*camera), 1);
  EXPECT_EQ(level(*camera), 2);
  EXPECT_EQ(level(*camera), 1);
}

TEST_F(ReplayCamera, FramesBelongToTheMomentAskedFor) {
  save("a.png", Image8(4, 3, 3, 1));
  const auto camera = open();
  ASSERT_TRUE(camera);
  const Instant moment = clock_.now() + 300ms;
  const auto frame = camera->frame_after(moment, 1s, {});
  ASSERT_TRUE(frame);
  EXPECT_EQ(frame->exposure_start, moment);
  EXPECT_EQ(clock_.now(), moment);
  EXPECT_EQ(camera->description().format, "RGB 4x3");
}

TEST_F(ReplayCamera, ADamagedPictureIsNamedAndStaysNext) {
  save("a.png", Image8(4, 3, 1, 1));
  ASSERT_TRUE(write_file_durably(folder_ / "b.png", "no picture"));
  const auto camera = open();
  ASSERT_TRUE(camera);
  EXPECT_EQ(level(*camera), 1);
  const auto damaged = camera->frame_after(clock_.now(), 1s, {});
  ASSERT_FALSE(damaged);
  EXPECT_THAT(damaged.error().message(), HasSubstr("b.png"));
  save("b.png", Image8(4, 3, 1, 2));
  EXPECT_EQ(level(*camera), 2);
}

TEST_F(ReplayCamera, PicturesOfAnotherSizeOrKindAreRefused) {
  save("a.png", Image8(4, 3, 1, 1));
  save("b.png", Image8(5, 3, 1, 2));
  const auto camera = open();
  ASSERT_TRUE(camera);
  EXPECT_EQ(level(*camera), 1);
  const auto other = camera->frame_after(clock_.now(), 1s, {});
  ASSERT_FALSE(other);
  EXPECT_THAT(other.error().message(), AllOf(HasSubstr("5x3"), HasSubstr("4x3")));
  save("b.png", Image8(4, 3, 3, 2));
  EXPECT_EQ(level(*camera), -1);
}

TEST_F(ReplayCamera, RefusesEverySettingByName) {
  save("a.png", Image8(4, 3, 1, 1));
  const auto camera = open();
  ASSERT_TRUE(camera);
  EXPECT_TRUE(camera->lock({}));
  EXPECT_TRUE(camera->controls()->empty());
  EXPECT_THAT(camera->lock({.exposure = 1ms}).error().message(), HasSubstr("exposure"));
  EXPECT_THAT(camera->lock({.gain = 1.0}).error().message(), HasSubstr("gain"));
  EXPECT_THAT(camera->lock({.white_balance_k = 5000}).error().message(),
              HasSubstr("white_balance_k"));
  EXPECT_THAT(camera->lock({.focus = 0.0}).error().message(), HasSubstr("focus"));
}

}  // namespace
}  // namespace skullstation
