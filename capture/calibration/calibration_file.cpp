#include "capture/calibration/calibration_file.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>

#include "capture/calibration/utc_text.h"
#include "core/file.h"
#include "core/session/strict_json.h"

namespace skullstation {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

constexpr std::string_view camera_format = "skullstation-camera-calibration/1";
constexpr std::string_view table_format = "skullstation-table-calibration/1";
constexpr int max_image_side_px = 65535;
constexpr int max_count = 1'000'000'000;
/// Departure of R'R from the identity that is taken for rounding in the file.
constexpr double rotation_tolerance = 1e-6;

// ---- reading ----

void read_format(JsonObject& object, std::string_view expected) {
  const std::string format = object.text("format");
  if (format != expected) {
    object.fault("format", fmt::format("is \"{}\"; \"{}\" was expected", format, expected),
                 "calibrate again with this version");
  }
}

double not_negative(JsonObject& object, std::string_view key) {
  const double value = object.number(key);
  if (value < 0.0) object.fault(key, fmt::format("must not be negative, but is {}", value));
  return value;
}

std::vector<double> list_of(JsonObject& object, std::string_view key, std::size_t size) {
  const json* value = object.require(key);
  std::vector<double> numbers;
  if (value != nullptr) numbers = object.numbers(key, *value);
  if (numbers.size() != size) {
    object.fault(key, fmt::format("must have {} numbers, not {}", size, numbers.size()));
    numbers.assign(size, 0.0);
  }
  return numbers;
}

Lens read_lens(JsonObject& object) {
  const int width = object.integer("width", 1, max_image_side_px);
  const int height = object.integer("height", 1, max_image_side_px);
  if (const std::string model = object.text("model"); model != "OPENCV") {
    object.fault("model", fmt::format("is \"{}\"; only OPENCV is written here", model));
  }
  const std::vector<double> params = list_of(object, "params", 8);
  if (!(params[0] > 0.0) || !(params[1] > 0.0)) {
    object.fault("params", "must begin with focal lengths greater than 0 px");
  }
  return Lens::from_params(width, height, LensModel::opencv, params);
}

Rigid3 read_pose(JsonObject& object, std::string_view key) {
  const json* value = object.require(key);
  if (value == nullptr) return {};
  const std::string expected = "must be a 4x4 matrix, row by row, with 0 0 0 1 as its last row";
  if (!value->is_array() || value->size() != 4) {
    object.fault(key, expected);
    return {};
  }
  Eigen::Matrix4d matrix;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::vector<double> row = object.numbers(fmt::format("{}[{}]", key, i), (*value)[i]);
    if (row.size() != 4) {
      object.fault(key, expected);
      return {};
    }
    for (std::size_t j = 0; j < 4; ++j) {
      matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = row[j];
    }
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double departure =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (matrix.row(3) != Eigen::RowVector4d(0.0, 0.0, 0.0, 1.0)) {
    object.fault(key, expected);
  } else if (!(departure <= rotation_tolerance) || rotation.determinant() < 0.0) {
    object.fault(key, "must hold a rotation in its upper left 3x3 part");
  }
  return Rigid3::from_matrix(matrix.topRows<3>());
}

CharucoBoard read_board(JsonObject& parent, JsonFaults& faults) {
  CharucoBoard board;
  const json* value = parent.require("board");
  if (value == nullptr) return board;
  JsonObject object(*value, parent.path("board"), faults);
  board.dictionary = object.text("dictionary");
  board.squares_x = object.integer("squares_x", 1, max_image_side_px);
  board.squares_y = object.integer("squares_y", 1, max_image_side_px);
  board.square_mm = object.number("square_mm");
  board.marker_mm = object.number("marker_mm");
  object.finish();
  if (const Result<void> valid = board.validate(); !valid && !faults.first()) {
    faults.report(parent.path("board"), valid.error().what, valid.error().advice);
  }
  return board;
}

Result<json> parse_file(const std::filesystem::path& file) {
  const Result<std::string> text = read_file(file);
  if (!text) return forward(text);
  return parse_strict_json(*text, file.string());
}

// ---- writing ----

ordered_json to_json(const Rigid3& pose) {
  const Eigen::Matrix4d matrix = pose.matrix();
  ordered_json rows = ordered_json::array();
  for (int i = 0; i < 4; ++i) {
    rows.push_back({matrix(i, 0), matrix(i, 1), matrix(i, 2), matrix(i, 3)});
  }
  return rows;
}

std::string text_of(const ordered_json& document) { return document.dump(2) + "\n"; }

}  // namespace

Result<CameraCalibration> read_camera_calibration(const std::filesystem::path& file) {
  const Result<json> document = parse_file(file);
  if (!document) return forward(document);
  JsonFaults faults(file.string());
  JsonObject object(*document, "", faults);
  CameraCalibration calibration;
  read_format(object, camera_format);
  calibration.camera = object.text("camera");
  calibration.device = object.text("device");
  calibration.created = object.text("created");
  calibration.lens = read_lens(object);
  calibration.standard_errors = list_of(object, "standard_errors", 8);
  calibration.rms_px = not_negative(object, "rms_px");
  calibration.views = object.integer("views", 0, max_count);
  calibration.corners = object.integer("corners", 0, max_count);
  object.finish();
  if (!from_iso8601(calibration.created)) {
    object.fault("created", "must be a UTC time like 2026-01-31T12:00:00Z");
  }
  if (faults.first()) return tl::unexpected<Error>(*faults.first());
  return calibration;
}

Result<void> write_camera_calibration(const CameraCalibration& calibration,
                                      const std::filesystem::path& file) {
  ordered_json document;
  document["format"] = camera_format;
  document["camera"] = calibration.camera;
  document["device"] = calibration.device;
  document["created"] = calibration.created;
  document["width"] = calibration.lens.width;
  document["height"] = calibration.lens.height;
  document["model"] = to_string(LensModel::opencv);
  document["params"] = calibration.lens.params(LensModel::opencv);
  document["standard_errors"] = calibration.standard_errors;
  document["rms_px"] = calibration.rms_px;
  document["views"] = calibration.views;
  document["corners"] = calibration.corners;
  return write_file_durably(file, text_of(document));
}

Result<TableCalibration> read_table_calibration(const std::filesystem::path& file) {
  const Result<json> document = parse_file(file);
  if (!document) return forward(document);
  JsonFaults faults(file.string());
  JsonObject object(*document, "", faults);
  TableCalibration calibration;
  read_format(object, table_format);
  calibration.created = object.text("created");
  calibration.board = read_board(object, faults);
  calibration.table_from_board = read_pose(object, "table_from_board");
  calibration.wobble_mm = not_negative(object, "wobble_mm");
  calibration.axis_error_deg = not_negative(object, "axis_error_deg");
  calibration.axis_error_mm = not_negative(object, "axis_error_mm");
  calibration.turn_ratio = not_negative(object, "turn_ratio");
  calibration.turn_ratio_error = not_negative(object, "turn_ratio_error");
  calibration.angle_rms_deg = not_negative(object, "angle_rms_deg");
  const std::optional<bool> reversed = object.optional_flag("reversed");
  if (!reversed) object.fault("reversed", "is missing; true or false was expected");
  calibration.reversed = reversed.value_or(false);
  object.each("cameras", [&](const json& element, const std::string& path) {
    JsonObject camera(element, path, faults);
    CameraPlacement& placement = calibration.cameras.emplace_back();
    placement.camera = camera.text("camera");
    placement.camera_from_station = read_pose(camera, "camera_from_station");
    placement.rms_px = not_negative(camera, "rms_px");
    camera.finish();
  });
  object.finish();
  if (!from_iso8601(calibration.created)) {
    object.fault("created", "must be a UTC time like 2026-01-31T12:00:00Z");
  }
  if (faults.first()) return tl::unexpected<Error>(*faults.first());
  return calibration;
}

Result<void> write_table_calibration(const TableCalibration& calibration,
                                     const std::filesystem::path& file) {
  ordered_json document;
  document["format"] = table_format;
  document["created"] = calibration.created;
  document["board"] = {{"dictionary", calibration.board.dictionary},
                       {"squares_x", calibration.board.squares_x},
                       {"squares_y", calibration.board.squares_y},
                       {"square_mm", calibration.board.square_mm},
                       {"marker_mm", calibration.board.marker_mm}};
  document["table_from_board"] = to_json(calibration.table_from_board);
  document["wobble_mm"] = calibration.wobble_mm;
  document["axis_error_deg"] = calibration.axis_error_deg;
  document["axis_error_mm"] = calibration.axis_error_mm;
  document["turn_ratio"] = calibration.turn_ratio;
  document["turn_ratio_error"] = calibration.turn_ratio_error;
  document["angle_rms_deg"] = calibration.angle_rms_deg;
  document["reversed"] = calibration.reversed;
  document["cameras"] = ordered_json::array();
  for (const CameraPlacement& placement : calibration.cameras) {
    ordered_json camera;
    camera["camera"] = placement.camera;
    camera["camera_from_station"] = to_json(placement.camera_from_station);
    camera["rms_px"] = placement.rms_px;
    document["cameras"].push_back(std::move(camera));
  }
  return write_file_durably(file, text_of(document));
}

}  // namespace skullstation
