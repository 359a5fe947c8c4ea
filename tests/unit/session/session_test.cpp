#include "core/session/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

#include "core/file.h"
#include "core/units.h"
#include "tests/support/temporary_folder.h"

namespace skullstation {
namespace {

using ::testing::HasSubstr;
using testing::real_data_folder;
using testing::TemporaryFolder;

Session full_session() {
  Session session;
  session.created = "2026-01-31T12:00:00.000Z";
  session.station = "ST-01";
  session.case_number = "2026-0042 \"Käte\"";
  session.cameras = {
      {"cam0", 1600, 1200, LensModel::opencv,
       std::vector<double>{2800.0 / 3.0, 2800.1, 807.3, 596.1, 1e-17, -0.1, 0, 5e-324}, false},
      {"cam1", 640, 480, LensModel::pinhole, std::nullopt, true}};
  session.board = CharucoBoard{"DICT_4X4_100", 10, 8, 20.5, 15.25};
  session.plan = SessionPlan{{{"cam0", 48}, {"cam1", 24}}, 2};
  session.complete = false;
  SessionView view;
  view.image = "images/p0_c0_000.png";
  view.camera = "cam0";
  view.pass = 1;
  view.table_angle_deg = 360.0 / 7.0;
  view.camera_from_table = rotation_about_z(33.3);
  view.camera_from_table->translation = {0.1, -1.0 / 3.0, 600.0};
  view.mask = "masks/a.png";
  view.exposure = std::chrono::microseconds(8001);
  view.captured = "2026-01-31T12:00:01.250Z";
  view.sha256 = std::string(64, 'a');
  ViewQuality quality;
  quality.sharpness = 0.1 + 0.2;
  quality.clipped_percent = 1.0 / 3.0;
  quality.dark_percent = 2.0 / 3.0;
  quality.mean_level = 123.456;
  quality.motion_px = 0.05;
  quality.border_percent = 1e-3;
  quality.specimen_percent = 22.2;
  quality.board_corners = 77;
  quality.attempts = 3;
  quality.rejected = "not sharp";
  view.quality = quality;
  session.views.push_back(view);
  SessionView bare;
  bare.image = "photo.jpg";
  bare.camera = "cam1";
  session.views.push_back(bare);
  return session;
}

constexpr const char* by_hand = R"({
  "format": "skullstation-session/1",
  "cameras": [ { "id": "a", "width": 640, "height": 480 } ],
  "views": [ { "image": "a.jpg", "camera": "a" }, { "image": "b.jpg", "camera": "a" } ]
})";

std::string with(std::string_view old_text, std::string_view new_text, std::string text = by_hand) {
  const auto at = text.find(old_text);
  EXPECT_NE(at, std::string::npos) << old_text;
  return text.replace(at, old_text.size(), new_text);
}

std::string error_of(const std::string& text) {
  const Result<Session> session = parse_session(text, "s/session.json");
  if (session) return "(read without an error)";
  EXPECT_EQ(session.error().kind, ErrorKind::bad_input);
  return session.error().message();
}

TEST(Session, ReadsBackExactlyWhatWasWritten) {
  const Session written = full_session();
  const Result<std::string> text = format_session(written);
  ASSERT_TRUE(text) << text.error().message();
  const Result<Session> read = parse_session(*text, "session.json");
  ASSERT_TRUE(read) << read.error().message();

  EXPECT_EQ(read->created, written.created);
  EXPECT_EQ(read->station, written.station);
  EXPECT_EQ(read->case_number, written.case_number);
  ASSERT_EQ(read->cameras.size(), 2U);
  EXPECT_EQ(read->cameras[0].id, "cam0");
  EXPECT_EQ(read->cameras[0].width, 1600);
  EXPECT_EQ(read->cameras[0].height, 1200);
  EXPECT_EQ(read->cameras[0].model, LensModel::opencv);
  EXPECT_EQ(read->cameras[0].params, written.cameras[0].params);
  EXPECT_FALSE(read->cameras[0].refine);
  EXPECT_EQ(read->cameras[1].model, LensModel::pinhole);
  EXPECT_EQ(read->cameras[1].params, std::nullopt);
  EXPECT_TRUE(read->cameras[1].refine);
  EXPECT_EQ(read->board, written.board);
  EXPECT_EQ(read->plan, written.plan);
  EXPECT_EQ(read->complete, false);

  ASSERT_EQ(read->views.size(), 2U);
  const SessionView& view = read->views[0];
  EXPECT_EQ(view.image, "images/p0_c0_000.png");
  EXPECT_EQ(view.camera, "cam0");
  EXPECT_EQ(view.pass, 1);
  EXPECT_EQ(view.table_angle_deg, 360.0 / 7.0);
  EXPECT_LT((view.camera_from_table->matrix() - written.views[0].camera_from_table->matrix())
                .cwiseAbs()
                .maxCoeff(),
            1e-15);
  EXPECT_EQ(view.camera_from_table->translation, written.views[0].camera_from_table->translation);
  EXPECT_EQ(view.mask, "masks/a.png");
  EXPECT_EQ(view.exposure, std::chrono::microseconds(8001));
  EXPECT_EQ(view.captured, "2026-01-31T12:00:01.250Z");
  EXPECT_EQ(view.sha256, std::string(64, 'a'));
  EXPECT_EQ(view.quality, written.views[0].quality);
  EXPECT_EQ(read->views[1].image, "photo.jpg");
  EXPECT_EQ(read->views[1].pass, 0);
  EXPECT_FALSE(read->views[1].quality);
}

TEST(Session, WritesTheSameTextAgain) {
  Session session = full_session();
  session.views[0].camera_from_table.reset();  // a quaternion rounds in the last digit
  const Result<std::string> text = format_session(session);
  ASSERT_TRUE(text);
  EXPECT_EQ(format_session(*parse_session(*text, "")), *text);
}

TEST(Session, ByHandNeedsNoMoreThanImagesAndCameras) {
  const Result<Session> session = parse_session(by_hand, "session.json");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_EQ(session->cameras[0].model, LensModel::opencv);
  EXPECT_EQ(session->cameras[0].params, std::nullopt);
  EXPECT_TRUE(session->cameras[0].refine);
  EXPECT_FALSE(session->board);
  EXPECT_FALSE(session->complete);
  EXPECT_EQ(session->views.size(), 2U);
}

TEST(Session, NullIsAbsentAndOwnNotesAreIgnored) {
  const Result<Session> session = parse_session(
      with("\"image\": \"a.jpg\"",
           R"("image": "./a.jpg", "camera_from_table": null, "mask": null, "x_note": [1, {}])"),
      "session.json");
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_EQ(session->views[0].image, "a.jpg");
  EXPECT_FALSE(session->views[0].camera_from_table);
  EXPECT_FALSE(session->views[0].mask);
}

TEST(Session, PosesMayBeRowsOrFlatThreeOrFourOfThem) {
  const std::string rows3 = "[[0,-1,0,1],[1,0,0,2],[0,0,1,3]]";
  const std::string rows4 = "[[0,-1,0,1],[1,0,0,2],[0,0,1,3],[0,0,0,1]]";
  const std::string flat3 = "[0,-1,0,1, 1,0,0,2, 0,0,1,3]";
  const std::string flat4 = "[0,-1,0,1, 1,0,0,2, 0,0,1,3, 0,0,0,1]";
  for (const std::string& pose : {rows3, rows4, flat3, flat4}) {
    const Result<Session> session = parse_session(
        with("\"image\": \"a.jpg\"", "\"camera_from_table\": " + pose + ", \"image\": \"a.jpg\""),
        "session.json");
    ASSERT_TRUE(session) << pose << session.error().message();
    const Eigen::Vector3d x = *session->views[0].camera_from_table * Eigen::Vector3d(1, 0, 0);
    EXPECT_LT((x - Eigen::Vector3d(1, 3, 3)).norm(), 1e-12) << pose;
  }
}

TEST(Session, EveryErrorNamesFileAndPlace) {
  const std::string a = "\"image\": \"a.jpg\"";
  const struct {
    std::string text;
    std::string expected;
  } cases[] = {
      {"", "s/session.json: line 1, column 0: is not valid JSON"},
      {with("480 }", "480 "), "s/session.json: line 3, column 58: is not valid JSON: syntax error"},
      {"[]", "s/session.json: must be an object, not array"},
      {"{}", "s/session.json: format: is missing"},
      {with("session/1", "session/2"), "written by a newer version"},
      {with("skullstation-session/1", "openmvg"),
       "format: is \"openmvg\"; \"skullstation-session/1\" was expected"},
      {with("\"cameras\"", "\"camera\""), "cameras: is missing"},
      {with("[ { \"id\": \"a\", \"width\": 640, \"height\": 480 } ]", "[]"),
       "cameras: must list at least one camera"},
      {with("\"width\": 640, ", ""), "cameras[0].width: is missing"},
      {with("640", "\"640\""), "cameras[0].width: must be a number, not \"640\""},
      {with("640", "0"), "cameras[0].width: must be a whole number from 1 to 65535, not 0"},
      {with("640", "640.5"), "cameras[0].width: must be a whole number"},
      {with("640", "1e999"), "is not valid JSON"},
      {with("\"width\"", "\"widht\": 1, \"width\""),
       "cameras[0].widht: is an unknown key; did you mean \"width\"?"},
      {with("\"width\"", "\"colour_profile\": 1, \"width\""),
       "cameras[0].colour_profile: is an unknown key; remove it, or begin it with \"x_\""},
      {with("\"width\"", "\"width\": 1, \"width\""), "has the key \"width\" twice"},
      {with("\"id\": \"a\"", "\"id\": \"\""), "cameras[0].id: must not be empty"},
      {with("480 }", "480, \"model\": \"FISHEYE\" }"),
       "cameras[0].model: is \"FISHEYE\"; PINHOLE or OPENCV was expected"},
      {with("480 }", "480, \"model\": \"PINHOLE\", \"params\": [1, 2, 3] }"),
       "cameras[0].params: must have 4 numbers (fx fy cx cy), not 3"},
      {with("480 }", "480, \"model\": \"PINHOLE\", \"params\": [1, 2, null, 3] }"),
       "cameras[0].params[2]: must be a number, not null"},
      {with("480 }", "480, \"model\": \"PINHOLE\", \"params\": [0, 1, 2, 3] }"),
       "cameras[0].params: must begin with focal lengths greater than 0 px"},
      {with("480 }", "480, \"params\": [1, 2, 3, 4] }"), "cameras[0].model: is missing"},
      {with("480 }", "480, \"refine\": 1 }"), "cameras[0].refine: must be true or false, not 1"},
      {with("480 } ]", "480 }, { \"id\": \"a\", \"width\": 1, \"height\": 1 } ]"),
       "cameras[1].id: \"a\" is another camera's id already"},
      {with("\"camera\": \"a\"", "\"camera\": \"b\""),
       "views[0].camera: \"b\" is no camera of this session; its cameras are: a"},
      {with(a + ",", ""), "views[0].image: is missing"},
      {with("a.jpg", ""), "views[0].image: must name a file inside the session"},
      {with("a.jpg", "images/"), "views[0].image: must name a file inside the session"},
      {with("a.jpg", "a\\u0000.jpg"), "views[0].image: must name a file inside the session"},
      {with("a.jpg", "/etc/passwd"), "views[0].image: leaves the session's folder"},
      {with("a.jpg", "x/../../a.jpg"), "views[0].image: leaves the session's folder"},
      {with(a, a + ", \"mask\": \"..\""), "views[0].mask: "},
      {with("b.jpg", "./a.jpg"), "views[1].image: \"a.jpg\" is another view's image already"},
      {with(a, a + ", \"pass\": -1"), "views[0].pass: must be a whole number from 0"},
      {with(a, a + ", \"table_angle_deg\": \"5\""), "views[0].table_angle_deg: must be a number"},
      {with(a, a + ", \"camera_from_table\": [[1,0,0,0],[0,1,0,0]]"),
       "views[0].camera_from_table: must be a 3x4 or 4x4 matrix"},
      {with(a, a + ", \"camera_from_table\": [[1,0,0],[0,1,0,0],[0,0,1,0]]"),
       "views[0].camera_from_table[0]: must be a row of 4 numbers"},
      {with(a, a + ", \"camera_from_table\": [1,0,0,0, 0,1,0,0, 0,0,1.0002,0]"),
       "views[0].camera_from_table: must hold a rotation"},
      {with(a, a + ", \"camera_from_table\": [1,0,0,0, 0,1,0,0, 0,0,-1,0]"), "and R mirrors"},
      {with(a, a + ", \"camera_from_table\": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,2]"),
       "views[0].camera_from_table: must have 0 0 0 1 as its last row"},
      {with(a, a + ", \"exposure_us\": -5"), "views[0].exposure_us: must be a whole number"},
      {with(a, a + ", \"captured\": \"yesterday\""),
       "views[0].captured: must be a UTC time like 2026-01-31T12:00:00Z, not \"yesterday\""},
      {with(a, a + ", \"sha256\": \"ABC\""),
       "views[0].sha256: must be 64 lower-case hexadecimal digits"},
      {with(a, a + ", \"quality\": {\"sharpnes\": 1}"),
       "views[0].quality.sharpnes: is an unknown key; did you mean \"sharpness\"?"},
      {with(a, a + ", \"quality\": {\"motion_px\": -1}"),
       "views[0].quality.motion_px: must not be negative"},
      {with("\"views\"", "\"board\": {\"kind\": \"chess\"}, \"views\""),
       "board.kind: is \"chess\"; only \"charuco\" boards are known"},
      {with("\"views\"",
            R"("board": {"kind": "charuco", "dictionary": "DICT_5X5_1000", "squares_x": 14,
               "squares_y": 14, "square_mm": 19, "marker_mm": 25}, "views")"),
       "s/session.json: board: "},
      {with("\"views\"",
            R"("plan": {"rings": [{"camera": "z", "views": 48}], "passes": 2}, "views")"),
       "plan.rings[0].camera: \"z\" is no camera of this session"},
      {with("\"views\"", R"("plan": {"rings": [], "passes": 0}, "views")"),
       "plan.passes: must be a whole number from 1"},
  };
  for (const auto& c : cases) EXPECT_THAT(error_of(c.text), HasSubstr(c.expected)) << c.text;
}

TEST(Session, DeepNestingAndForeignBytesAreOrdinaryErrors) {
  EXPECT_THAT(error_of(std::string(100'000, '[')), HasSubstr("is not valid JSON"));
  EXPECT_THAT(error_of(with("\"a.jpg\"", std::string(50'000, '[') + std::string(50'000, ']'))),
              HasSubstr("views[0].image: must be a string, not array"));
  EXPECT_THAT(error_of("\xff\xfe\x00"), HasSubstr("is not valid JSON"));
}

TEST(Session, RefusesToWriteWhatItCouldNotRead) {
  Session session = full_session();
  session.views[0].quality->sharpness = std::nan("");
  ASSERT_TRUE(format_session(session)) << "NaN is written as null, which counts as absent";
  session = full_session();
  session.cameras[0].params->at(0) = std::numeric_limits<double>::infinity();
  EXPECT_FALSE(format_session(session));
  session = full_session();
  session.views[1].camera = "nobody";
  EXPECT_THAT(format_session(session).error().message(), HasSubstr("views[1].camera"));
  session = full_session();
  session.station = "\xff";
  EXPECT_THAT(format_session(session).error().message(), HasSubstr("not UTF-8"));
}

TEST(SessionFolder, WritesAndReads) {
  const TemporaryFolder folder;
  ASSERT_TRUE(write_session(full_session(), folder.path()));
  const Result<Session> session = read_session(folder.path());
  ASSERT_TRUE(session) << session.error().message();
  EXPECT_EQ(session->views.size(), 2U);
}

TEST(SessionFolder, ErrorsNameTheFile) {
  const TemporaryFolder folder;
  EXPECT_THAT(read_session(folder.path()).error().message(),
              HasSubstr("is not a capture session: it has no session.json"));
  ASSERT_TRUE(write_file_durably(folder / "session.json", "{"));
  EXPECT_THAT(read_session(folder.path()).error().message(),
              HasSubstr((folder / "session.json").string()));
  EXPECT_FALSE(write_session(full_session(), folder / "nowhere"));
}

TEST(SessionFolder, ImagesAreVerifiedByTheirHash) {
  const TemporaryFolder folder;
  Session session = full_session();
  session.views[0].sha256 = sha256_hex("pixels");
  ASSERT_TRUE(make_writable_folder(folder / "images"));
  const std::filesystem::path first = folder / "images/p0_c0_000.png";
  EXPECT_THAT(verify_images(session, folder.path()).error().message(), HasSubstr(first.string()));
  ASSERT_TRUE(write_file_durably(first, "pixels"));
  EXPECT_THAT(verify_images(session, folder.path()).error().message(), HasSubstr("photo.jpg"));
  ASSERT_TRUE(write_file_durably(folder / "photo.jpg", "has no recorded hash"));
  EXPECT_TRUE(verify_images(session, folder.path()));
  ASSERT_TRUE(write_file_durably(first, "pixelz"));
  EXPECT_THAT(verify_images(session, folder.path()).error().message(),
              HasSubstr("is not the image that was recorded"));
}

/// templeR_par.txt: name, K, R, t of each image; metres.
TEST(SessionFolder, RealPhotographsWithKnownCamerasBecomeASession) {
  const std::filesystem::path temple = real_data_folder() / "temple-ring";
  if (!std::filesystem::exists(temple)) GTEST_SKIP() << "no real data at " << temple;
  std::istringstream lines(*read_file(temple / "templeR_par.txt"));
  int count = 0;
  lines >> count;
  Session session;
  for (int i = 0; i < count; ++i) {
    std::string name;
    lines >> name;
    double v[21];
    for (double& value : v) lines >> value;
    if (i == 0) {
      // Their pixel (0, 0) is a centre, ours is a corner.
      session.cameras.push_back({"cam0", 640, 480, LensModel::pinhole,
                                 std::vector<double>{v[0], v[4], v[2] + 0.5, v[5] + 0.5}, false});
    }
    Eigen::Matrix<double, 3, 4> pose;
    pose << v[9], v[10], v[11], 1000.0 * v[18], v[12], v[13], v[14], 1000.0 * v[19], v[15], v[16],
        v[17], 1000.0 * v[20];
    SessionView& view = session.views.emplace_back();
    view.image = "images/" + name;
    view.camera = "cam0";
    view.camera_from_table = Rigid3::from_matrix(pose);
    view.sha256 = sha256_hex(*read_file(temple / name));
  }
  ASSERT_EQ(session.views.size(), 47U);

  const TemporaryFolder folder;
  std::filesystem::create_directory_symlink(temple, folder / "images");
  ASSERT_TRUE(write_session(session, folder.path()));
  const Result<Session> read = read_session(folder.path());
  ASSERT_TRUE(read) << read.error().message();
  EXPECT_TRUE(verify_images(*read, folder.path()));

  // The middle of the published bounding box lies inside every picture.
  const Eigen::Vector3d middle(27.76, 41.81, -54.67);
  const SessionCamera& camera = read->cameras[0];
  const Lens lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
  for (const SessionView& view : read->views) {
    const Eigen::Vector3d x = *view.camera_from_table * middle;
    ASSERT_GT(x.z(), 0.0);
    const Eigen::Vector2d px = lens.project(x);
    EXPECT_GT(px.x(), 200.0) << view.image;
    EXPECT_LT(px.x(), 440.0) << view.image;
    EXPECT_GT(px.y(), 140.0) << view.image;
    EXPECT_LT(px.y(), 340.0) << view.image;
  }
}

}  // namespace
}  // namespace skullstation
