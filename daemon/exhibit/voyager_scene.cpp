#include "daemon/exhibit/exhibit_parts.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Json model_json(const ExhibitModel& model) {
  const Json asset = {{"uri", model.file},
                      {"type", "Model"},
                      {"mimeType", "model/gltf-binary"},
                      {"byteSize", model.bytes},
                      {"numFaces", model.extent.triangles}};
  const Json derivative = {
      {"usage", "Web3D"}, {"quality", "High"}, {"assets", Json::array({asset})}};
  return {{"units", "m"},
          {"derivatives", Json::array({derivative})},
          {"boundingBox", {{"min", model.extent.min}, {"max", model.extent.max}}}};
}

/// Voyager's matrices are column-major.
Json in_columns(const nlohmann::json& rows) {
  Json matrix = Json::array();
  for (std::size_t column = 0; column < 4; ++column) {
    for (std::size_t row = 0; row < 4; ++row) matrix.push_back(Json(rows[row][column]));
  }
  return matrix;
}

}  // namespace

Json voyager_scene(const Exhibit& exhibit) {
  Json nodes = Json::array();
  Json roots = Json::array();
  Json models = Json::array();
  for (const ExhibitModel& model : exhibit.models) {
    Json node = {{"name", model.title}, {"model", models.size()}};
    if (model.scene_from_model) node["matrix"] = in_columns(*model.scene_from_model);
    roots.push_back(nodes.size());
    nodes.push_back(node);
    models.push_back(model_json(model));
  }
  roots.push_back(nodes.size());
  nodes.push_back({{"name", "Camera"}, {"translation", {0, 0, 900}}, {"camera", 0}});
  roots.push_back(nodes.size());
  nodes.push_back(
      {{"name", "Light from the front"}, {"translation", {300, 500, 900}}, {"light", 0}});
  roots.push_back(nodes.size());
  nodes.push_back({{"name", "Light from all round"}, {"light", 1}});

  Json asset = {{"type", "application/si-dpo-3d.document+json"},
                {"version", "1.0"},
                {"generator", exhibit.made_by}};
  if (!exhibit.label.rights.empty()) asset["copyright"] = exhibit.label.rights;
  const Json collection = {{"titles", {{"EN", exhibit.title}}},
                           {"edanRecordId", exhibit.case_number},
                           {"institution", exhibit.label.holder}};
  const Json process = {{"station", exhibit.station},
                        {"program", exhibit.made_by},
                        {"package_sha256", exhibit.package_sha256},
                        {"warnings", exhibit.warnings}};
  const Json setup = {
      {"units", "mm"},
      {"viewer", {{"shader", "Default"}, {"exposure", 1}, {"gamma", 2}}},
      {"navigation",
       {{"type", "Orbit"}, {"enabled", true}, {"autoZoom", true}, {"lightsFollowCamera", true}}}};
  return {
      {"asset", asset},
      {"scene", 0},
      {"scenes", Json::array({{{"units", "mm"}, {"nodes", roots}, {"setup", 0}, {"meta", 0}}})},
      {"nodes", nodes},
      {"metas", Json::array({{{"collection", collection}, {"process", process}}})},
      {"setups", Json::array({setup})},
      {"cameras",
       Json::array({{{"type", "perspective"},
                     {"perspective", {{"yfov", 0.6}, {"znear", 1.0}, {"zfar", 10000.0}}}}})},
      {"lights", Json::array({{{"type", "directional"}, {"color", {1, 1, 1}}, {"intensity", 1}},
                              {{"type", "ambient"}, {"color", {1, 1, 1}}, {"intensity", 0.4}}})},
      {"models", models}};
}

}  // namespace skullstation
