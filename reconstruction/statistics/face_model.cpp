#include "reconstruction/statistics/face_model.h"

#include <fmt/format.h>

namespace skullstation {

Result<void> FaceModel::validate() const {
  const auto bad = [](std::string what) {
    return fail(ErrorKind::bad_input, "face model", std::move(what), "build it again");
  };
  if (const auto sound = skull_template.validate(); !sound) return forward(sound);
  if (const auto sound = head_template.validate(); !sound) return forward(sound);
  for (const ShapeModel* model : {&skull, &head}) {
    if (const auto sound = model->validate(); !sound) return forward(sound);
  }
  if (const auto sound = tissue.validate(); !sound) return forward(sound);
  if (const auto sound = joint.validate(); !sound) return forward(sound);
  if (skull.vertex_count() != skull_template.vertices.rows()) {
    return bad(fmt::format("its skull model has {} vertices, its skull template {}",
                           skull.vertex_count(), skull_template.vertices.rows()));
  }
  if (head.vertex_count() != head_template.vertices.rows()) {
    return bad(fmt::format("its head model has {} vertices, its head template {}",
                           head.vertex_count(), head_template.vertices.rows()));
  }
  if (tissue.vertex_count() != skull_template.boundary_count) {
    return bad(fmt::format("its tissue model has {} vertices, the skull's surface {}",
                           tissue.vertex_count(), skull_template.boundary_count));
  }
  return {};
}

}  // namespace skullstation
