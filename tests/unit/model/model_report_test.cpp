#include "daemon/model/model_report.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "daemon/report/html_page.h"
#include "reconstruction/statistics/build_face_model.h"
#include "tests/unit/statistics/ball_people.h"

namespace skullstation {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

const ModelSource& balls() {
  static const ModelSource source = [] {
    FaceModelOptions options;
    options.tissue.modes = 2;
    ModelSource made;
    made.model = build_face_model(testing::skull_template(), testing::head_template(),
                                  testing::people(20), options, "{}")
                     .value();
    made.name = "balls.h5";
    made.sha256 = std::string(64, 'b');
    made.card = "Made of <balls>.";
    made.remarks = {{"person 7", "left out: is person 3 again"}};
    return made;
  }();
  return source;
}

constexpr ReportPictureOptions small = {.width_px = 16, .samples = 1, .threads = 2};

TEST(ModelReport, ShowsModesTissueAndWhoTheSubjectsWere) {
  const auto report = model_report(balls(), small);
  ASSERT_TRUE(report) << report.error().message();
  EXPECT_THAT(html_page(*report),
              AllOf(HasSubstr("Made of &lt;balls&gt;."), HasSubstr("person 3 again"),
                    HasSubstr("mode 1, -2 SD"), HasSubstr("mode 2, +2 SD"),
                    HasSubstr("subjects measured, 0 to 20"), HasSubstr("balls.h5"),
                    HasSubstr("<svg"), Not(HasSubstr("http"))));
}

TEST(ModelReport, StopsWhenAsked) {
  std::stop_source stop;
  stop.request_stop();
  Progress progress;
  progress.stop = stop.get_token();
  const auto page = model_report(balls(), small, progress);
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().kind, ErrorKind::cancelled);
}

}  // namespace
}  // namespace skullstation
