// `skullstation reconstruct` on a small simulated scan: the surface, and what it says to sessions
// that are damaged, too small or not what they say.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "core/session/session.h"
#include "reconstruction/io/ply.h"
#include "tests/e2e/small_station.h"
#include "tests/support/process.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

namespace fs = std::filesystem;
using skullstation::testing::ProcessResult;
using skullstation::testing::skullstation_cli;
using skullstation::testing::SmallStation;
using skullstation::testing::TemporaryFolder;
using skullstation::testing::write_small_station;
using ::testing::HasSubstr;

class Reconstruct : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    scanned_ = std::make_unique<TemporaryFolder>();
    SmallStation station;
    station.views_per_ring = 12;
    station.passes = 1;
    const auto config = write_small_station(scanned_->path(), station);
    const auto scan = skullstation_cli(
        {"scan", "--config", config.string(), "--out", (*scanned_ / "session").string()});
    ASSERT_EQ(scan.exit_code, 0) << scan.err;
  }
  static void TearDownTestSuite() { scanned_.reset(); }

  void SetUp() override {
    fs::copy(*scanned_ / "session", session(), fs::copy_options::recursive);
    // The simulated lens, known as a calibration would have it.
    change([](nlohmann::json& json) {
      for (auto& camera : json["cameras"]) {
        camera["params"] = {560.0, 560.0, 167.3, 116.1, -0.08, 0.03, 0.0004, -0.0003};
      }
      for (auto& view : json["views"]) view.erase("sha256");
    });
  }

  fs::path session() const { return folder_ / "session"; }
  fs::path out() const { return folder_ / "out"; }

  template <class Change>
  void change(const Change& how) {
    auto json = nlohmann::json::parse(*read_file(session() / "session.json"));
    how(json);
    ASSERT_TRUE(write_file_durably(session() / "session.json", json.dump(2)));
  }
  ProcessResult reconstruct(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words = {"reconstruct", session().string(), "--out", out().string(),
                                      "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return skullstation_cli(words);
  }

  static inline std::unique_ptr<TemporaryFolder> scanned_;
  TemporaryFolder folder_;
};

TEST_F(Reconstruct, MakesAMetricSurfaceAndItsReport) {
  const auto result = reconstruct();
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["views_used"], 24);
  EXPECT_EQ(json["scale_source"], "board");

  const auto mesh = read_ply(out() / "skull.ply");
  ASSERT_TRUE(mesh) << mesh.error().message();
  EXPECT_EQ(mesh->colors.rows(), mesh->vertices.rows());
  // A pear of about 138 x 170 x 140 mm, seen from above only, with pixels of 1.3 mm.
  const Eigen::RowVector3d size =
      mesh->vertices.colwise().maxCoeff() - mesh->vertices.colwise().minCoeff();
  const double shorter = std::min(size.x(), size.y());
  EXPECT_GT(shorter, 95.0);
  EXPECT_LT(shorter, 145.0);
  EXPECT_LT(size.head<2>().norm(), 225.0);
  EXPECT_GT(size.z(), 60.0);
  EXPECT_LT(size.z(), 145.0);

  const auto quality = nlohmann::json::parse(*read_file(out() / "quality.json"));
  EXPECT_EQ(quality["per_view"].size(), 24U);
  EXPECT_EQ(quality["scale"]["source"], "board");
  EXPECT_GT(quality["scale"]["standard_error_percent"].get<double>(), 0.0);
  const auto cameras = parse_session(*read_file(out() / "cameras.json"), "cameras.json");
  ASSERT_TRUE(cameras) << cameras.error().message();
  for (const SessionView& view : cameras->views) EXPECT_TRUE(view.camera_from_table) << view.image;
  for (const char* file : {"skull.glb", "coverage.ply", "preview_front.png", "quality_coverage.png",
                           "quality_accuracy.png"}) {
    EXPECT_TRUE(fs::exists(out() / file)) << file;
  }
}

TEST_F(Reconstruct, ResultsAreTheSameForOneAndTwoThreads) {
  ASSERT_EQ(reconstruct({"--threads", "1", "--quality", "draft"}).exit_code, 0);
  const auto first = read_file(out() / "skull.ply");
  fs::rename(out(), folder_ / "first");
  ASSERT_EQ(reconstruct({"--threads", "2", "--quality", "draft"}).exit_code, 0);
  const auto second = read_file(out() / "skull.ply");
  ASSERT_TRUE(first && second);
  EXPECT_TRUE(*first == *second);
}

TEST_F(Reconstruct, RefusesAFolderThatIsNotEmpty) {
  ASSERT_TRUE(write_file_durably(folder_ / "precious.txt", "mine"));
  const auto result =
      skullstation_cli({"reconstruct", session().string(), "--out", folder_.path().string()});
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_TRUE(fs::exists(folder_ / "precious.txt"));
}

TEST_F(Reconstruct, NamesAMissingPhotograph) {
  fs::remove(session() / "images/p0_c1_003.png");
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("p0_c1_003.png"));
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Reconstruct, NamesATruncatedJpeg) {
  const auto image = read_image(session() / "images/p0_c0_002.png");
  ASSERT_TRUE(image);
  const std::string jpeg = encode_jpeg(*image, 90);
  ASSERT_TRUE(write_file_durably(session() / "images/cut.jpg", jpeg.substr(0, jpeg.size() / 2)));
  change([](nlohmann::json& json) { json["views"][2]["image"] = "images/cut.jpg"; });
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("cut.jpg"));
}

TEST_F(Reconstruct, TwoViewsAreTooFew) {
  change([](nlohmann::json& json) {
    json["views"] = nlohmann::json::array({json["views"][0], json["views"][1]});
  });
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("3 are needed"));
}

TEST_F(Reconstruct, BlackPhotographsShowNoBoard) {
  const Image8 black(320, 240, 3);
  for (const auto& file : fs::directory_iterator(session() / "images")) {
    ASSERT_TRUE(write_file_durably(file.path(), encode_png(black)));
  }
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("none of the 24 views shows the board"));
}

TEST_F(Reconstruct, WrongIntrinsicsAreRefused) {
  change([](nlohmann::json& json) {
    for (auto& camera : json["cameras"]) {
      camera["params"] = {616.0, 616.0, 167.3, 116.1, -0.08, 0.03, 0.0004, -0.0003};
    }
  });
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("focal length"));
}

TEST_F(Reconstruct, AnotherBoardIsNotFound) {
  change([](nlohmann::json& json) { json["board"]["dictionary"] = "DICT_4X4_1000"; });
  const auto result = reconstruct();
  EXPECT_EQ(result.exit_code, 5);
  EXPECT_THAT(result.err, HasSubstr("is it another board?"));
}

/// Each pixel the mean of those up to `radius` beside it in its row, then in its column.
Image8 blurred(const Image8& image, int radius) {
  Image8 from = image;
  for (const auto& [right, down] : {std::pair(1, 0), std::pair(0, 1)}) {
    Image8 to = from;
    for (int y = 0; y < from.height; ++y) {
      for (int x = 0; x < from.width; ++x) {
        for (int c = 0; c < from.channels; ++c) {
          int sum = 0;
          for (int i = -radius; i <= radius; ++i) {
            sum += from.at(std::clamp(x + i * right, 0, from.width - 1),
                           std::clamp(y + i * down, 0, from.height - 1), c);
          }
          to.at(x, y, c) = static_cast<std::uint8_t>(sum / (2 * radius + 1));
        }
      }
    }
    from = to;
  }
  return from;
}

TEST_F(Reconstruct, ABlurredViewIsLeftOutAndNamed) {
  const auto image = read_image(session() / "images/p0_c1_007.png");
  ASSERT_TRUE(image);
  ASSERT_TRUE(
      write_file_durably(session() / "images/p0_c1_007.png", encode_png(blurred(*image, 5))));
  const auto result = reconstruct({"--quality", "draft"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["views_used"], 23);
  EXPECT_THAT(json["verdicts"].dump(), HasSubstr("p0_c1_007.png is left out"));
}

TEST_F(Reconstruct, AViewOfNothingIsLeftOutAndNamed) {
  const Image8 black(320, 240, 3);
  ASSERT_TRUE(write_file_durably(session() / "images/p0_c0_005.png", encode_png(black)));
  const auto result = reconstruct({"--quality", "draft"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const auto json = nlohmann::json::parse(result.out);
  EXPECT_EQ(json["views_used"], 23);
  EXPECT_THAT(json["verdicts"].dump(), HasSubstr("p0_c0_005.png"));
}

}  // namespace
}  // namespace skullstation
