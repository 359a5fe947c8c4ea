#pragma once

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

struct SessionCamera {
  std::string id;
  int width = 0;
  int height = 0;
  LensModel model = LensModel::opencv;
  std::optional<std::vector<double>> params;  ///< px; absent: to be estimated
  bool refine = true;                         ///< may a reconstruction adjust the intrinsics?
};

/// What the capture gates measured on one view, and their verdict. "Specimen" is what the gates
/// take for it (capture/scan/specimen_mask.h).
struct ViewQuality {
  double sharpness = 0.0;         ///< detail at the finest scale (capture/scan/image_quality.h)
  double clipped_percent = 0.0;   ///< of the specimen's pixels at 255
  double dark_percent = 0.0;      ///< of the specimen's pixels below 8
  double mean_level = 0.0;        ///< of the specimen, 0..255
  double motion_px = 0.0;         ///< shift between two frames taken after settling
  double border_percent = 0.0;    ///< of the frame's border that the specimen touches
  double specimen_percent = 0.0;  ///< of the frame that the specimen covers
  int board_corners = 0;          ///< inner corners of the board seen
  int attempts = 1;               ///< how often the view was taken
  std::optional<std::string> rejected;  ///< why the last attempt failed its gate, if it did

  bool operator==(const ViewQuality&) const = default;
};

/// What a station set out to photograph: rings of views, the same in each pass.
struct SessionPlan {
  struct Ring {
    std::string camera;  ///< SessionCamera::id
    int views = 48;      ///< evenly spread over one turn of the table
    bool operator==(const Ring&) const = default;
  };
  std::vector<Ring> rings;
  int passes = 2;  ///< placements of the specimen: upright, turned over

  bool operator==(const SessionPlan&) const = default;
};

struct SessionView {
  std::string image;   ///< path inside the session
  std::string camera;  ///< SessionCamera::id
  int pass = 0;        ///< placement of the specimen: between passes it moved on the table
  std::optional<double> table_angle_deg;
  std::optional<Rigid3> camera_from_table;
  std::optional<std::string> mask;
  std::optional<std::chrono::microseconds> exposure;
  std::optional<std::string> captured;  ///< UTC, ISO 8601
  std::optional<std::string> sha256;
  std::optional<ViewQuality> quality;  ///< gate values; absent in sessions written by hand
};

/// The content of session.json (format "skullstation-session/1", DESIGN section 6).
struct Session {
  std::string created;  ///< UTC, ISO 8601
  std::string station;
  std::string case_number;
  std::vector<SessionCamera> cameras;
  std::optional<CharucoBoard> board;
  std::optional<SessionPlan> plan;  ///< absent in sessions written by hand
  std::vector<SessionView> views;
  /// Absent in sessions written by hand. True once every planned view is recorded.
  std::optional<bool> complete;
};

/// The content of a session.json; `name` stands for the file in error messages, which also give
/// the JSON path ("views[3].camera"). Errors are: unknown keys (but for those that begin with
/// "x_"), unknown camera ids, missing fields, wrong types, paths that leave the session, duplicate
/// images, poses that are no rotation.
Result<Session> parse_session(std::string_view json, std::string_view name);

/// The text of a session.json, one view a line. Numbers are written so that reading them gives
/// the same doubles. Fails for what parse_session() would refuse.
Result<std::string> format_session(const Session& session);

/// Reads DIR/session.json as parse_session() does. Image files are not opened; verify_images()
/// does that.
Result<Session> read_session(const std::filesystem::path& folder);

/// Whole or not at all (write_file_durably).
Result<void> write_session(const Session& session, const std::filesystem::path& folder);

/// The view's image is there and matches its recorded SHA-256 (if it has one).
Result<void> verify_image(const SessionView& view, const std::filesystem::path& folder);

/// Every image is there and matches its recorded SHA-256; names the first that does not.
Result<void> verify_images(const Session& session, const std::filesystem::path& folder);

}  // namespace skullstation
