#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/result.h"
#include "reconstruction/statistics/face_model.h"
#include "reconstruction/templates/template_file.h"

namespace skullstation {

/// A model and where it came from.
struct ModelSource {
  FaceModel model;
  std::string name;  ///< of the file
  std::string sha256;
  std::string card;  ///< who it was made from, in plain words
  /// Of subjects that were left out, or lack something: name, and what has to be said.
  std::vector<std::pair<std::string, std::string>> remarks;
};

/// The model in `file`, or without a file the one that is built into the program. Fails as
/// read_file and decode_model do.
Result<ModelSource> load_model(const std::optional<std::filesystem::path>& file);

/// The templates in `file`, which `template build` made, or without a file those of the default
/// model.
Result<Templates> load_templates(const std::optional<std::filesystem::path>& file);

}  // namespace skullstation
