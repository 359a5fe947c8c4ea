#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/result.h"
#include "core/session/charuco_board.h"
#include "core/session/lens.h"
#include "core/transform.h"

namespace skullstation {

/// A camera as the poses' search gets it.
struct PoseCamera {
  std::string id;
  int width = 0;
  int height = 0;
  LensModel model = LensModel::opencv;  ///< what a refined lens may have
  std::optional<Lens> lens;             ///< absent: to be estimated
  bool refine = true;                   ///< may the lens be adjusted?
};

/// One photograph as the poses' search gets it.
struct PoseObservation {
  std::string name;  ///< for messages: the image's path
  int camera = 0;    ///< index of its PoseCamera
  int pass = 0;
  std::optional<double> table_angle_deg;  ///< as commanded
  std::optional<Rigid3> given;            ///< camera_from_table that came with the session
  std::vector<BoardCorner> corners;
};

/// What became of one view.
struct ViewPose {
  std::string name;
  Rigid3 camera_from_table;
  int corners = 0;  ///< of the board, that count
  int points = 0;   ///< of the specimen, shared with other views; 0 without structure from motion
  double rms_px = 0.0;  ///< reprojection error
  /// Standard error of the camera's place and direction; 0 where it is not known.
  double position_error_mm = 0.0;
  double rotation_error_deg = 0.0;
  std::string dropped;  ///< why the view can't be used; empty if it is
  std::string remark;   ///< what is odd about a view that is used; empty if nothing

  bool used() const { return dropped.empty(); }
};

/// What the unit of length rests on.
enum class ScaleSource { board, given_poses, camera_radius, unknown };

/// "board", "given poses", "table angles and camera radius", "unknown".
const char* to_string(ScaleSource source);

/// Lens after the adjustment with the standard error of its focal length (0: not adjusted).
struct AdjustedLens {
  Lens lens;
  double focal_error_px = 0.0;
};

/// How the table moved in one pass, against a pure rotation.
struct TableMotion {
  int pass = 0;
  bool reversed = false;        ///< it turns clockwise seen from above for growing angles
  double angle_rms_deg = 0.0;   ///< commanded against measured angles
  double departure_mm = 0.0;    ///< typical, at the specimen's size from the axis; noise taken out
  double axis_offset_mm = 0.0;  ///< of the axis from the board's centre
  Rigid3 table_from_board;
};

struct PoseResult {
  std::vector<AdjustedLens> lenses;  ///< one a camera
  std::vector<ViewPose> views;       ///< one an observation, in their order
  std::vector<TableMotion> table;    ///< one a pass whose table angles are known
  ScaleSource scale = ScaleSource::unknown;
  /// Standard error of the scale, in percent: from the corners' noise, the board taken for true.
  double scale_error_percent = 0.0;
  double rms_px = 0.0;             ///< over all corners of the views used
  double corner_noise_px = 0.0;    ///< standard deviation of one coordinate
  std::vector<std::string> notes;  ///< sentences that a person should read

  /// Of the pass; the identity where the table's axis is not known.
  Rigid3 table_from_board(int pass) const;
};

}  // namespace skullstation
