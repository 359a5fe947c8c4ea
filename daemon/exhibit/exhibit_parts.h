#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "daemon/exhibit/exhibit.h"
#include "daemon/exhibit/glb_container.h"

namespace skullstation {

/// A model of the exhibit.
// NOLINTNEXTLINE(bugprone-exception-escape): moving a JSON value throws nothing in fact
struct ExhibitModel {
  std::string file;   ///< "skull.glb"
  std::string title;  ///< "Skull as scanned"
  std::uint64_t bytes = 0;
  GlbExtent extent;
  /// Where it stands in the scene, 4x4 in rows [mm]: x_scene = M x_model, glTF's axes. Absent: as
  /// it is.
  std::optional<nlohmann::json> scene_from_model;
};

struct ExhibitPicture {
  std::string file;
  std::string title;
  int width = 0;
  int height = 0;
};

/// What is shown, for the files that describe it.
// NOLINTNEXTLINE(bugprone-exception-escape): moving a JSON value throws nothing in fact
struct Exhibit {
  ExhibitLabel label;
  std::string address;  ///< of the folder, without a slash at its end; empty: not known
  std::string title;
  std::string case_number;
  std::string station;
  std::string made_by;         ///< program and version
  std::string package_sha256;  ///< of its tag manifest: what the signatures are of
  std::vector<std::string> warnings;
  std::vector<ExhibitModel> models;
  std::vector<ExhibitPicture> pictures;
};

/// Smithsonian Voyager's document (.svx.json, schemas.3d.si.edu/voyager).
nlohmann::ordered_json voyager_scene(const Exhibit& exhibit);

/// IIIF Presentation API 3.0. Its canvases are the pictures; the models are renderings of the whole
/// (canvases of 3D content are a draft of the next version).
nlohmann::ordered_json iiif_manifest(const Exhibit& exhibit);

}  // namespace skullstation
