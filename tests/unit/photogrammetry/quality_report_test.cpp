#include "reconstruction/photogrammetry/quality_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>
#include <nlohmann/json.hpp>

namespace skullstation {
namespace {

using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

/// A right triangle of 2 cm2, well photographed by three views.
SessionReconstruction good_reconstruction() {
  SessionReconstruction reconstruction;
  TriangleMesh& mesh = reconstruction.surface.mesh;
  mesh.vertices.resize(3, 3);
  mesh.vertices << 0, 0, 0, 20, 0, 0, 0, 20, 0;
  mesh.triangles.resize(1, 3);
  mesh.triangles << 0, 1, 2;
  reconstruction.surface.coverage = {{3, 4, 12}, {0.2F, 0.2F, 0.25F}, {0.05F, 0.04F, 0.06F}, 68.0};
  reconstruction.cameras.cameras = {{.id = "cam0", .width = 1600, .height = 1200, .params = {}}};
  PoseResult& poses = reconstruction.poses;
  poses.scale = ScaleSource::board;
  poses.scale_error_percent = 0.05;
  poses.rms_px = 0.06;
  AdjustedLens lens;
  lens.lens.fx = 2800.0;
  lens.focal_error_px = 0.7;
  poses.lenses = {lens};
  for (int i = 0; i < 3; ++i) {
    ViewPose& view = poses.views.emplace_back();
    view.name = "images/" + std::to_string(i) + ".png";
    view.corners = 100;
    view.rms_px = 0.05 + 0.01 * i;
    SessionView& taken = reconstruction.cameras.views.emplace_back();
    taken.image = view.name;
    taken.camera = "cam0";
  }
  return reconstruction;
}

std::vector<std::string> verdicts_of(const SessionReconstruction& reconstruction) {
  return quality_verdicts(reconstruction, quality_figures(reconstruction));
}

TEST(QualityReport, SaysNothingWhereAllIsWell) {
  EXPECT_THAT(verdicts_of(good_reconstruction()), IsEmpty());
}

TEST(QualityReport, CountsViewsAreaAndCoverage) {
  const QualityFigures figures = quality_figures(good_reconstruction());
  EXPECT_EQ(figures.views, 3);
  EXPECT_EQ(figures.views_used, 3);
  EXPECT_NEAR(figures.area_cm2, 2.0, 1e-9);
  EXPECT_DOUBLE_EQ(figures.seen_by_three_percent, 100.0);
  EXPECT_FLOAT_EQ(static_cast<float>(figures.ground_sample_mm), 0.2F);
  EXPECT_FLOAT_EQ(static_cast<float>(figures.accuracy_mm), 0.05F);
  EXPECT_DOUBLE_EQ(figures.open_edge_mm, 68.0);
}

TEST(QualityReport, TellsWhatIsAGuessFromWhatIsMeasured) {
  SessionReconstruction reconstruction = good_reconstruction();
  reconstruction.surface.coverage.views[0] = 0;  // a guess
  reconstruction.surface.filled = {{true, false, false}, 0.5, 2, 0};
  const QualityFigures figures = quality_figures(reconstruction);
  EXPECT_NEAR(figures.area_cm2, 1.5, 1e-9);
  EXPECT_DOUBLE_EQ(figures.filled_cm2, 0.5);
  EXPECT_DOUBLE_EQ(figures.seen_by_three_percent, 100.0);
  EXPECT_THAT(verdicts_of(reconstruction), Contains(HasSubstr("0.50 cm2 were not measured")));
  const auto json = nlohmann::json::parse(quality_json(reconstruction));
  EXPECT_EQ(json["surface"]["filled_cm2"], 0.5);
  EXPECT_EQ(json["surface"]["openings_filled"], 2);
}

TEST(QualityReport, NamesAViewThatIsLeftOutAndWhy) {
  SessionReconstruction reconstruction = good_reconstruction();
  reconstruction.poses.views[1].dropped = "does not show the board";
  EXPECT_THAT(verdicts_of(reconstruction),
              Contains(HasSubstr("images/1.png is left out: does not show the board")));
}

TEST(QualityReport, PassesOnWhatTheScansGatesSaid) {
  SessionReconstruction reconstruction = good_reconstruction();
  reconstruction.cameras.views[2].quality.emplace().rejected = "blurred";
  EXPECT_THAT(verdicts_of(reconstruction), Contains(HasSubstr("images/2.png did not pass")));
}

TEST(QualityReport, SaysWhatToDoAboutEachShortcoming) {
  struct Case {
    std::function<void(SessionReconstruction&)> spoil;
    const char* words;
  };
  const std::vector<Case> cases = {
      {[](auto& r) {
         r.surface.coverage.views = {1, 1, 5};
       },
       "take more views"},
      {[](auto& r) {
         r.surface.coverage.ground_sample_mm = {0.9F, 0.9F, 0.9F};
       },
       "bring the camera nearer"},
      {[](auto& r) {
         r.surface.coverage.accuracy_mm = {0.9F, 0.9F, 0.9F};
       },
       "focus and light"},
      {[](auto& r) { r.poses.scale_error_percent = 0.3; }, "standard error of 0.30 %"},
      {[](auto& r) { r.poses.lenses[0].focal_error_px = 14.0; }, "cam0 is known to 0.5 % only"},
      {[](auto& r) { r.poses.table.emplace_back().departure_mm = 0.4; }, "lies fixed"},
      {[](auto& r) { r.poses.notes = {"nothing tells the scale"}; }, "nothing tells the scale"},
  };
  for (const Case& one : cases) {
    SessionReconstruction reconstruction = good_reconstruction();
    one.spoil(reconstruction);
    EXPECT_THAT(verdicts_of(reconstruction), ::testing::ElementsAre(HasSubstr(one.words)));
  }
}

TEST(QualityReport, AsJsonHasEveryView) {
  SessionReconstruction reconstruction = good_reconstruction();
  reconstruction.poses.views[1].dropped = "does not show the board";
  reconstruction.joined = {{1, {Rigid3{}, 0.5, 0.1, 1.4}}};
  const auto json = nlohmann::json::parse(quality_json(reconstruction));
  EXPECT_EQ(json["format"], "skullstation-reconstruction-quality/1");
  EXPECT_EQ(json["views_used"], 2);
  EXPECT_EQ(json["scale"]["source"], "board");
  EXPECT_THAT(json["per_view"], SizeIs(3));
  EXPECT_EQ(json["per_view"][0]["rms_px"], 0.05);
  EXPECT_EQ(json["per_view"][1]["dropped"], "does not show the board");
  EXPECT_FALSE(json["per_view"][1].contains("rms_px"));
  EXPECT_EQ(json["surface"]["vertices_by_views"]["8 or more"], 1);
  EXPECT_EQ(json["joined_passes"][0]["pass"], 1);
  EXPECT_THAT(json["verdicts"], SizeIs(1));
}

TEST(QualityReport, ColoursTellCoverageAndAccuracy) {
  const SessionReconstruction reconstruction = good_reconstruction();
  const TriangleMesh by_views = colored_by_coverage(reconstruction.surface.mesh, {0, 2, 9});
  EXPECT_GT(by_views.colors(0, 0), by_views.colors(0, 1));  // red
  EXPECT_GT(by_views.colors(1, 1), by_views.colors(1, 2));  // yellow
  EXPECT_LT(by_views.colors(2, 0), by_views.colors(2, 2));  // blue
  const TriangleMesh by_error =
      colored_by_accuracy(reconstruction.surface.mesh, {0.0F, 0.01F, 9.0F});
  EXPECT_EQ(by_error.colors(0, 0), by_error.colors(0, 2));  // grey
  EXPECT_GT(by_error.colors(1, 2), by_error.colors(1, 0));  // blue
  EXPECT_GT(by_error.colors(2, 0), by_error.colors(2, 2));  // red
}

}  // namespace
}  // namespace skullstation
