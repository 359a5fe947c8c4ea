// `skullstation calibrate` on the simulated station, measured against its truth.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "capture/calibration/calibration_file.h"
#include "core/file.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using skullstation::testing::ProcessResult;
using skullstation::testing::skullstation_cli;
using skullstation::testing::TemporaryFolder;
using ::testing::HasSubstr;

constexpr int width = 1200;
constexpr int height = 900;

class Calibrate : public ::testing::Test {
 protected:
  ProcessResult calibrate(const std::string& what, const std::string& simulation = "") {
    std::ofstream(folder_ / "station.toml")
        << "[station]\ncalibration_folder = \"" << folder_.path().string()
        << "\"\n[simulation]\nrender_samples = 2\n"
        << simulation << "[[camera]]\nid = \"low\"\nwidth = " << width << "\nheight = " << height
        << "\n[camera.simulated]\nelevation_deg = 30\nk1 = -0.12\nk2 = 0.05\n";
    return skullstation_cli(
        {"calibrate", what, "--json", "--config", (folder_ / "station.toml").string()});
  }

  TemporaryFolder folder_;
};

TEST_F(Calibrate, CameraFindsTheTrueLens) {
  const auto result = calibrate("camera");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto calibration = read_camera_calibration(folder_ / "camera-low.json");
  ASSERT_TRUE(calibration) << calibration.error().message();
  const Lens& lens = calibration->lens;
  const double true_f = 1.75 * width;
  EXPECT_NEAR(lens.fx / true_f, 1.0, 0.001);
  EXPECT_NEAR(lens.fy / true_f, 1.0, 0.001);
  EXPECT_NEAR(lens.cx, 0.5 * width + 7.3, 1.0);
  EXPECT_NEAR(lens.cy, 0.5 * height - 3.9, 1.0);
  // Distortion: where both lenses put the same directions, over the whole image. What a shift of
  // the principal point or the focal length alone would do is part of it, which is stricter.
  Lens truth = lens;
  truth.fx = truth.fy = true_f;
  truth.cx = 0.5 * width + 7.3;
  truth.cy = 0.5 * height - 3.9;
  truth.k1 = -0.12;
  truth.k2 = 0.05;
  truth.p1 = 0.0004;
  truth.p2 = -0.0003;
  double squares = 0.0;
  int count = 0;
  for (int y = 0; y <= height; y += 50) {
    for (int x = 0; x <= width; x += 50) {
      const auto ray = truth.ray({x, y});
      ASSERT_TRUE(ray);
      squares += (lens.project(*ray) - Eigen::Vector2d(x, y)).squaredNorm();
      ++count;
    }
  }
  const double rms_px = std::sqrt(squares / count);
  EXPECT_LT(rms_px, 0.5);
  std::cout << "fx " << 100.0 * (lens.fx / true_f - 1.0) << " %, centre " << lens.cx - truth.cx
            << " " << lens.cy - truth.cy << " px, rays apart by RMS " << rms_px << " px\n";
}

TEST_F(Calibrate, TableFindsTheAxisAndATrueTurn) {
  ASSERT_EQ(calibrate("camera").exit_code, 0);
  const auto result = calibrate("table");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_NEAR(json["turn_ratio"].get<double>(), 1.0, 5e-4);
  EXPECT_LT(json["wobble_mm"].get<double>(), 0.3);
}

TEST_F(Calibrate, TableDetectsTwoPercentSlip) {
  ASSERT_EQ(calibrate("camera").exit_code, 0);
  const auto result = calibrate("table", "slip_fraction = 0.02\n");
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("2.0 % less"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "table.json"));
}

TEST_F(Calibrate, TableWithoutABoardIsRefused) {
  const auto result = calibrate("table", "[board]\npresent = false\n");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("board.present"));
}

TEST_F(Calibrate, TableNeedsACalibratedCamera) {
  const auto result = calibrate("table");
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("calibrate camera"));
}

TEST_F(Calibrate, PicturesWithoutABoardAreRefused) {
  std::filesystem::create_directories(folder_ / "pictures");
  ASSERT_TRUE(write_file_durably(folder_ / "pictures/a.png", "no picture"));
  const auto result =
      skullstation_cli({"calibrate", "camera", "--camera", "cam0", "--images",
                        (folder_ / "pictures").string(), "--out", (folder_ / "c.json").string()});
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("a.png"));
}

}  // namespace
}  // namespace skullstation
