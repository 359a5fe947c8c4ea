#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include "core/session/session.h"
#include "core/session/strict_json.h"

namespace skullstation {

using nlohmann::json;
using nlohmann::ordered_json;

namespace {

constexpr std::string_view format_name = "skullstation-session/1";
constexpr int max_image_side_px = 65535;
constexpr int max_passes = 1000;
/// Departure of R'R from the identity that is taken for rounding in the file.
constexpr double rotation_tolerance = 1e-4;

// ---- reading ----

bool is_utc_time(const std::string& text) {
  constexpr std::string_view shape = "0000-00-00T00:00:00";
  if (text.size() < shape.size() + 1 || text.back() != 'Z') return false;
  const auto digit = [](char c) { return c >= '0' && c <= '9'; };
  for (std::size_t i = 0; i < shape.size(); ++i) {
    if (shape[i] == '0' ? !digit(text[i]) : text[i] != shape[i]) return false;
  }
  const std::string_view fraction =
      std::string_view(text).substr(shape.size(), text.size() - shape.size() - 1);
  return fraction.empty() || (fraction.size() > 1 && fraction.front() == '.' &&
                              std::ranges::all_of(fraction.substr(1), digit));
}

std::optional<std::string> read_time(JsonObject& object, std::string_view key) {
  std::optional<std::string> time = object.optional_text(key);
  if (time && !is_utc_time(*time)) {
    object.fault(key,
                 fmt::format("must be a UTC time like 2026-01-31T12:00:00Z, not \"{}\"", *time));
  }
  return time;
}

/// A path inside the session, in its shortest form.
std::optional<std::string> read_path(JsonObject& object, std::string_view key) {
  const std::optional<std::string> text = object.optional_text(key);
  if (!text) return std::nullopt;
  const std::filesystem::path path = std::filesystem::path(*text).lexically_normal();
  if (text->empty() || text->find('\0') != std::string::npos || !path.has_filename() ||
      path == ".") {
    object.fault(key, "must name a file inside the session");
  } else if (path.is_absolute() || *path.begin() == "..") {
    object.fault(key, fmt::format("leaves the session's folder: \"{}\"", *text),
                 "copy or link the images into the session and give the path inside it");
  }
  return path.string();
}

double read_not_negative(JsonObject& object, std::string_view key) {
  const double value = object.optional_number(key).value_or(0.0);
  if (value < 0.0) object.fault(key, fmt::format("must not be negative, but is {}", value));
  return value;
}

SessionCamera read_camera(const json& value, const std::string& path, JsonFaults& faults) {
  JsonObject object(value, path, faults);
  SessionCamera camera;
  camera.id = object.text("id");
  if (camera.id.empty()) object.fault("id", "must not be empty");
  camera.width = object.integer("width", 1, max_image_side_px);
  camera.height = object.integer("height", 1, max_image_side_px);
  const std::optional<std::string> model = object.optional_text("model");
  if (model) {
    if (const Result<LensModel> known = lens_model_from_string(*model)) {
      camera.model = *known;
    } else {
      object.fault("model", fmt::format("is \"{}\"; PINHOLE or OPENCV was expected", *model));
    }
  }
  if (const json* params = object.find("params")) {
    camera.params = object.numbers("params", *params);
    const auto expected = static_cast<std::size_t>(parameter_count(camera.model));
    if (!model) {
      object.fault("model", "is missing; params need it");
    } else if (camera.params->size() != expected) {
      object.fault("params",
                   fmt::format("must have {} numbers ({}), not {}", expected,
                               camera.model == LensModel::pinhole ? "fx fy cx cy"
                                                                  : "fx fy cx cy k1 k2 p1 p2",
                               camera.params->size()));
    } else if ((*camera.params)[0] <= 0.0 || (*camera.params)[1] <= 0.0) {
      object.fault("params", "must begin with focal lengths greater than 0 px");
    }
  }
  camera.refine = object.optional_flag("refine").value_or(true);
  object.finish();
  return camera;
}

CharucoBoard read_board(const json& value, JsonFaults& faults) {
  JsonObject object(value, "board", faults);
  CharucoBoard board;
  if (const std::string kind = object.text("kind"); kind != "charuco") {
    object.fault("kind", fmt::format("is \"{}\"; only \"charuco\" boards are known", kind));
  }
  board.dictionary = object.text("dictionary");
  board.squares_x = object.integer("squares_x", 2, 1000);
  board.squares_y = object.integer("squares_y", 2, 1000);
  board.square_mm = object.number("square_mm");
  board.marker_mm = object.number("marker_mm");
  object.finish();
  if (!faults.first()) {
    if (const Result<void> valid = board.validate(); !valid) {
      faults.report("board", valid.error().what, valid.error().advice);
    }
  }
  return board;
}

SessionPlan read_plan(const json& value, JsonFaults& faults) {
  JsonObject object(value, "plan", faults);
  SessionPlan plan;
  object.each("rings", [&](const json& element, const std::string& path) {
    JsonObject ring(element, path, faults);
    SessionPlan::Ring& added = plan.rings.emplace_back();
    added.camera = ring.text("camera");
    added.views = ring.integer("views", 1, 1'000'000);
    ring.finish();
  });
  plan.passes = object.integer("passes", 1, max_passes);
  object.finish();
  return plan;
}

/// 3x4 or 4x4, row-major, as an array of rows or flat.
std::optional<Rigid3> read_pose(JsonObject& object, std::string_view key) {
  const json* value = object.find(key);
  if (value == nullptr) return std::nullopt;
  std::vector<double> entries;
  const bool of_rows = value->is_array() && !value->empty() && value->front().is_array();
  if (of_rows) {
    for (std::size_t i = 0; i < value->size(); ++i) {
      const std::string row_key = fmt::format("{}[{}]", key, i);
      const std::vector<double> row = object.numbers(row_key, (*value)[i]);
      if (row.size() != 4) {
        object.fault(row_key, "must be a row of 4 numbers");
        return std::nullopt;
      }
      entries.insert(entries.end(), row.begin(), row.end());
    }
  } else {
    entries = object.numbers(key, *value);
  }
  if (entries.size() != 12 && entries.size() != 16) {
    object.fault(key, "must be a 3x4 or 4x4 matrix, row by row");
    return std::nullopt;
  }
  if (entries.size() == 16 &&
      !(entries[12] == 0.0 && entries[13] == 0.0 && entries[14] == 0.0 && entries[15] == 1.0)) {
    object.fault(key, "must have 0 0 0 1 as its last row");
    return std::nullopt;
  }
  Eigen::Matrix<double, 3, 4> matrix;
  for (int i = 0; i < 12; ++i) matrix(i / 4, i % 4) = entries[static_cast<std::size_t>(i)];
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double departure =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(departure <= rotation_tolerance) || rotation.determinant() < 0.0) {
    object.fault(key,
                 fmt::format("must hold a rotation in its left 3x3 part; R'R departs from the "
                             "identity by {:.2g}{}",
                             departure, rotation.determinant() < 0.0 ? " and R mirrors" : ""),
                 "x_camera = R x_table + t with t in mm");
    return std::nullopt;
  }
  return Rigid3::from_matrix(matrix);
}

ViewQuality read_quality(const json& value, const std::string& path, JsonFaults& faults) {
  JsonObject object(value, path, faults);
  ViewQuality quality;
  quality.sharpness = read_not_negative(object, "sharpness");
  quality.clipped_percent = read_not_negative(object, "clipped_percent");
  quality.dark_percent = read_not_negative(object, "dark_percent");
  quality.mean_level = read_not_negative(object, "mean_level");
  quality.motion_px = read_not_negative(object, "motion_px");
  quality.border_percent = read_not_negative(object, "border_percent");
  quality.specimen_percent = read_not_negative(object, "specimen_percent");
  quality.board_corners =
      static_cast<int>(object.optional_integer("board_corners", 0, 1'000'000).value_or(0));
  quality.attempts = static_cast<int>(object.optional_integer("attempts", 1, 1000).value_or(1));
  quality.rejected = object.optional_text("rejected");
  object.finish();
  return quality;
}

SessionView read_view(const json& value, const std::string& path, JsonFaults& faults) {
  JsonObject object(value, path, faults);
  SessionView view;
  const std::optional<std::string> image = read_path(object, "image");
  if (!image) object.fault("image", "is missing; the image's path inside the session was expected");
  view.image = image.value_or("");
  view.camera = object.text("camera");
  view.pass = static_cast<int>(object.optional_integer("pass", 0, max_passes).value_or(0));
  view.table_angle_deg = object.optional_number("table_angle_deg");
  view.camera_from_table = read_pose(object, "camera_from_table");
  view.mask = read_path(object, "mask");
  if (const auto us = object.optional_integer("exposure_us", 0, 1'000'000'000'000)) {
    view.exposure = std::chrono::microseconds(*us);
  }
  view.captured = read_time(object, "captured");
  view.sha256 = object.optional_text("sha256");
  if (view.sha256 && (view.sha256->size() != 64 ||
                      view.sha256->find_first_not_of("0123456789abcdef") != std::string::npos)) {
    object.fault("sha256", "must be 64 lower-case hexadecimal digits");
  }
  if (const json* quality = object.find("quality")) {
    view.quality = read_quality(*quality, object.path("quality"), faults);
  }
  object.finish();
  return view;
}

/// What no single object can tell: ids are unique and resolve, images are listed once.
void check_references(const Session& session, JsonFaults& faults) {
  std::set<std::string> ids;
  for (std::size_t i = 0; i < session.cameras.size(); ++i) {
    if (!ids.insert(session.cameras[i].id).second) {
      faults.report(fmt::format("cameras[{}].id", i),
                    fmt::format("\"{}\" is another camera's id already", session.cameras[i].id));
    }
  }
  const auto check_camera = [&](const std::string& id, const std::string& path) {
    if (!ids.contains(id)) {
      faults.report(path, fmt::format("\"{}\" is no camera of this session", id),
                    fmt::format("its cameras are: {}", fmt::join(ids, ", ")));
    }
  };
  if (session.plan) {
    for (std::size_t i = 0; i < session.plan->rings.size(); ++i) {
      check_camera(session.plan->rings[i].camera, fmt::format("plan.rings[{}].camera", i));
    }
  }
  std::set<std::string> images;
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    check_camera(session.views[i].camera, fmt::format("views[{}].camera", i));
    if (!images.insert(session.views[i].image).second) {
      faults.report(fmt::format("views[{}].image", i),
                    fmt::format("\"{}\" is another view's image already", session.views[i].image));
    }
  }
}

// ---- writing ----

ordered_json to_json(const SessionCamera& camera) {
  ordered_json object;
  object["id"] = camera.id;
  object["width"] = camera.width;
  object["height"] = camera.height;
  object["model"] = to_string(camera.model);
  object["params"] = camera.params ? ordered_json(*camera.params) : ordered_json(nullptr);
  object["refine"] = camera.refine;
  return object;
}

ordered_json to_json(const CharucoBoard& board) {
  ordered_json object;
  object["kind"] = "charuco";
  object["dictionary"] = board.dictionary;
  object["squares_x"] = board.squares_x;
  object["squares_y"] = board.squares_y;
  object["square_mm"] = board.square_mm;
  object["marker_mm"] = board.marker_mm;
  return object;
}

ordered_json to_json(const SessionPlan& plan) {
  ordered_json rings = ordered_json::array();
  for (const SessionPlan::Ring& ring : plan.rings) {
    rings.push_back(ordered_json{{"camera", ring.camera}, {"views", ring.views}});
  }
  ordered_json object;
  object["rings"] = std::move(rings);
  object["passes"] = plan.passes;
  return object;
}

ordered_json to_json(const Rigid3& pose) {
  const Eigen::Matrix4d matrix = pose.matrix();
  ordered_json rows = ordered_json::array();
  for (int r = 0; r < 4; ++r) {
    rows.push_back({matrix(r, 0), matrix(r, 1), matrix(r, 2), matrix(r, 3)});
  }
  return rows;
}

ordered_json to_json(const ViewQuality& quality) {
  ordered_json object;
  object["sharpness"] = quality.sharpness;
  object["clipped_percent"] = quality.clipped_percent;
  object["dark_percent"] = quality.dark_percent;
  object["mean_level"] = quality.mean_level;
  object["motion_px"] = quality.motion_px;
  object["border_percent"] = quality.border_percent;
  object["specimen_percent"] = quality.specimen_percent;
  object["board_corners"] = quality.board_corners;
  object["attempts"] = quality.attempts;
  object["rejected"] = quality.rejected ? ordered_json(*quality.rejected) : ordered_json(nullptr);
  return object;
}

ordered_json to_json(const SessionView& view) {
  ordered_json object;
  object["image"] = view.image;
  object["camera"] = view.camera;
  object["pass"] = view.pass;
  if (view.table_angle_deg) object["table_angle_deg"] = *view.table_angle_deg;
  if (view.camera_from_table) object["camera_from_table"] = to_json(*view.camera_from_table);
  if (view.mask) object["mask"] = *view.mask;
  if (view.exposure) object["exposure_us"] = view.exposure->count();
  if (view.captured) object["captured"] = *view.captured;
  if (view.sha256) object["sha256"] = *view.sha256;
  if (view.quality) object["quality"] = to_json(*view.quality);
  return object;
}

/// One element a line: a session of a hundred views stays readable and comparable.
template <class T>
std::string lines_of(const std::vector<T>& elements) {
  std::string text = "[";
  for (const T& element : elements) {
    text += fmt::format("{}\n    {}", &element == &elements.front() ? "" : ",",
                        to_json(element).dump());
  }
  return text + (elements.empty() ? "]" : "\n  ]");
}

}  // namespace

Result<Session> parse_session(std::string_view text, std::string_view name) {
  const Result<json> document = parse_strict_json(text, name);
  if (!document) return forward(document);
  JsonFaults faults(name);
  JsonObject object(*document, "", faults);
  if (const std::string format = object.text("format"); format != format_name) {
    object.fault("format", fmt::format("is \"{}\"; \"{}\" was expected", format, format_name),
                 format.starts_with("skullstation-session/")
                     ? "this session was written by a newer version of the program"
                     : "");
  }
  Session session;
  session.created = read_time(object, "created").value_or("");
  session.station = object.optional_text("station").value_or("");
  session.case_number = object.optional_text("case").value_or("");
  object.each("cameras", [&](const json& camera, const std::string& path) {
    session.cameras.push_back(read_camera(camera, path, faults));
  });
  if (session.cameras.empty()) object.fault("cameras", "must list at least one camera");
  if (const json* board = object.find("board")) session.board = read_board(*board, faults);
  if (const json* plan = object.find("plan")) session.plan = read_plan(*plan, faults);
  session.complete = object.optional_flag("complete");
  object.each("views", [&](const json& view, const std::string& path) {
    session.views.push_back(read_view(view, path, faults));
  });
  object.finish();
  check_references(session, faults);
  if (faults.first()) return tl::unexpected<Error>(*faults.first());
  return session;
}

Result<std::string> format_session(const Session& session) {
  std::string text;
  try {
    text = fmt::format("{{\n  \"format\": {}", json(format_name).dump());
    const auto add = [&text](std::string_view key, const std::string& value) {
      text += fmt::format(",\n  \"{}\": {}", key, value);
    };
    if (!session.created.empty()) add("created", json(session.created).dump());
    if (!session.station.empty()) add("station", json(session.station).dump());
    if (!session.case_number.empty()) add("case", json(session.case_number).dump());
    if (session.complete) add("complete", *session.complete ? "true" : "false");
    add("cameras", lines_of(session.cameras));
    if (session.board) add("board", to_json(*session.board).dump());
    if (session.plan) add("plan", to_json(*session.plan).dump());
    add("views", lines_of(session.views));
    text += "\n}\n";
  } catch (const json::exception&) {
    return fail(ErrorKind::bad_input, "session.json", "can't be written: a text is not UTF-8",
                "look at the names of the station, the case and the cameras");
  }
  // A file that we could not read again is never written.
  if (const Result<Session> readable = parse_session(text, "session.json"); !readable) {
    return forward(readable);
  }
  return text;
}

}  // namespace skullstation
