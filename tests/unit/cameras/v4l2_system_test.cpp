// The kernel's own calls, on descriptors that need no camera.
#include "capture/cameras/v4l2_system.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/videodev2.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <thread>
#include <utility>

#include "capture/cameras/v4l2_camera.h"

namespace skullstation {
namespace {

using namespace std::chrono_literals;

class Pipe {
 public:
  Pipe() { EXPECT_EQ(::pipe2(ends_.data(), O_NONBLOCK | O_CLOEXEC), 0); }
  ~Pipe() {
    ::close(ends_[0]);
    if (ends_[1] >= 0) ::close(ends_[1]);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  int reading() const { return ends_[0]; }
  void write() const { EXPECT_EQ(::write(ends_[1], "x", 1), 1); }
  void hang_up() { ::close(std::exchange(ends_[1], -1)); }

 private:
  std::array<int, 2> ends_{-1, -1};
};

TEST(KernelV4l2System, OpenTellsWhyItFails) {
  const auto system = kernel_v4l2_system();
  EXPECT_EQ(system->open("/nonexistent/video0"), -ENOENT);
  EXPECT_EQ(system->open("/"), -EISDIR);
}

TEST(KernelV4l2System, CallsOnWhatIsNoVideoDeviceFail) {
  const auto system = kernel_v4l2_system();
  const int descriptor = system->open("/dev/null");
  ASSERT_GE(descriptor, 0);
  v4l2_capability capability{};
  EXPECT_EQ(system->ioctl(descriptor, VIDIOC_QUERYCAP, &capability), -ENOTTY);
  EXPECT_EQ(system->map(descriptor, 4096, 0), nullptr);
  system->close(descriptor);
}

TEST(KernelV4l2System, AFileThatIsNoCameraIsAClearError) {
  const auto camera = open_v4l2_camera({.device = "/dev/null"});
  ASSERT_FALSE(camera);
  EXPECT_EQ(camera.error().kind, ErrorKind::hardware);
  EXPECT_EQ(camera.error().where, "/dev/null");
  EXPECT_EQ(camera.error().what, "is not a video device");
}

TEST(KernelV4l2System, ListingCamerasWorksOnAnyMachine) {
  for (const V4l2CameraInfo& camera : list_v4l2_cameras()) EXPECT_FALSE(camera.node.empty());
}

TEST(KernelV4l2System, WaitSeesWhatIsReady) {
  const Pipe pipe;
  pipe.write();
  const auto system = kernel_v4l2_system();
  EXPECT_EQ(system->wait(pipe.reading(), system->now() + 1h, {}), 1);
}

TEST(KernelV4l2System, WaitEndsAtItsDeadline) {
  const Pipe pipe;
  const auto system = kernel_v4l2_system();
  const Instant deadline = system->now() + 5ms;
  EXPECT_EQ(system->wait(pipe.reading(), deadline, {}), 0);
  EXPECT_GE(system->now(), deadline);
  EXPECT_EQ(system->wait(pipe.reading(), system->now() - 1s, {}), 0);
}

TEST(KernelV4l2System, WaitSeesAHangUp) {
  Pipe pipe;
  pipe.hang_up();
  const auto system = kernel_v4l2_system();
  EXPECT_EQ(system->wait(pipe.reading(), system->now() + 1h, {}), -EPIPE);
}

TEST(KernelV4l2System, AStopRequestEndsTheWaitBeforeAndDuringIt) {
  const Pipe pipe;
  const auto system = kernel_v4l2_system();
  std::stop_source before;
  before.request_stop();
  EXPECT_EQ(system->wait(pipe.reading(), system->now() + 1h, before.get_token()), -ECANCELED);

  std::stop_source during;
  const std::jthread stopper([&during] { during.request_stop(); });
  EXPECT_EQ(system->wait(pipe.reading(), system->now() + 1h, during.get_token()), -ECANCELED);
}

}  // namespace
}  // namespace skullstation
