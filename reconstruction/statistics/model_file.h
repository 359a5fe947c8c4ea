#pragma once

#include <string>

#include "core/result.h"
#include "reconstruction/statistics/face_model.h"

namespace skullstation {

/// The file's content (HDF5). `/skull` and `/head` are shape models in Statismo's layout, so that
/// Scalismo and its friends open them; the rest as in docs/models.md. The same bytes for the
/// same model.
Result<std::string> encode_model(const FaceModel& model);

/// The model in the file's bytes; `name` is what errors call the file. Fails with `bad_input` for a
/// file that is cut off, of another kind, of another version, or inconsistent, naming the place in
/// it.
Result<FaceModel> decode_model(std::string bytes, const std::string& name);

/// A shape model alone, as others publish them in Statismo's layout, with its surface.
struct StatismoModel {
  ShapeModel model;
  Triangles triangles;  ///< #F x 3
};

/// The Statismo model in group `group` ("/" or "/skull") of a file.
Result<StatismoModel> decode_statismo(std::string bytes, const std::string& name,
                                      const std::string& group = "/");

}  // namespace skullstation
