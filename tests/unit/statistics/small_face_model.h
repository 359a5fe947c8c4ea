#pragma once

#include "core/random.h"
#include "reconstruction/statistics/face_model.h"
#include "tests/unit/statistics/test_surfaces.h"

namespace skullstation::testing {

/// A ball for a skull, with its centre as the one inner vertex, in a larger ball for a head.
inline SkullTemplate ball_skull(double radius_mm) {
  const TriangleMesh surface = sphere(radius_mm, 6, 8);
  const auto count = static_cast<int>(surface.vertices.rows());
  SkullTemplate skull;
  skull.vertices.resize(count + 1, 3);
  skull.vertices << surface.vertices, Eigen::RowVector3d::Zero();
  skull.boundary = surface.triangles;
  skull.boundary_count = count;
  skull.tetrahedra.resize(surface.triangles.rows(), 4);
  skull.tetrahedra << surface.triangles.rowwise().reverse(),
      Eigen::VectorXi::Constant(surface.triangles.rows(), count);
  skull.region.assign(static_cast<std::size_t>(count) + 1, SkullRegion::maxilla);
  skull.outer.assign(static_cast<std::size_t>(count), true);
  for (int v = 0; v < count; ++v) {
    skull.mirror.push_back({Eigen::Vector3i::Constant(v), Eigen::Vector3d::UnitX()});
  }
  skull.landmarks = {{"nasion", {{0, 1, 2}, {0.25, 0.5, 0.25}}},
                     {"gonion left", {{3, 4, 5}, {1.0, 0.0, 0.0}}}};
  return skull;
}

inline HeadTemplate ball_head(double radius_mm) {
  const TriangleMesh surface = sphere(radius_mm, 6, 8);
  const auto count = static_cast<std::size_t>(surface.vertices.rows());
  HeadTemplate head;
  head.vertices = surface.vertices;
  head.triangles = surface.triangles;
  head.region.assign(count, HeadRegion::face);
  head.region[3] = HeadRegion::nose;
  for (std::size_t v = 0; v < count; ++v) head.mirror.push_back(static_cast<int>(v));
  head.data_weight.assign(count, 0.5);
  head.landmarks = {{"pronasale", {{6, 7, 8}, {0.0, 0.5, 0.5}}}};
  return head;
}

inline FaceModel small_face_model() {
  Random random(5);
  FaceModel model;
  model.skull_template = ball_skull(80.0);
  model.head_template = ball_head(90.0);
  std::vector<Points3> skulls;
  std::vector<Points3> heads;
  const auto people = 8;
  Eigen::MatrixXd depths(model.skull_template.boundary_count, people);
  for (Eigen::Index n = 0; n < people; ++n) {
    Points3 skull = model.skull_template.vertices * (1.0 + 0.05 * random.normal());
    skull.col(1) *= 1.0 + 0.03 * random.normal();
    Points3 head = model.head_template.vertices * (1.0 + 0.05 * random.normal());
    head.col(2) *= 1.0 + 0.03 * random.normal();
    skulls.push_back(skull);
    heads.push_back(head);
    const double thick = std::exp(0.2 * random.normal());
    for (double& depth : depths.col(n)) depth = 8.0 * thick * std::exp(0.03 * random.normal());
  }
  model.skull =
      build_shape_model(skulls, Eigen::VectorXd::Ones(skulls.front().rows()), {1.0, 2}).value();
  model.head =
      build_shape_model(heads, Eigen::VectorXd::Ones(heads.front().rows()), {1.0, 2}).value();
  TissueModelOptions tissue;
  tissue.modes = 1;
  model.tissue = build_tissue_model(depths, sphere(80.0, 6, 8), tissue).value();
  Eigen::MatrixXd values(2, people);
  for (Eigen::Index n = 0; n < people; ++n) {
    values(0, n) = coefficients_of(model.skull, skulls[static_cast<std::size_t>(n)])[0];
    values(1, n) = coefficients_of(model.head, heads[static_cast<std::size_t>(n)])[0];
  }
  const VariableBlock blocks[] = {{"skull", {"skull 1"}, {}, {}}, {"head", {"head 1"}, {}, {}}};
  model.joint = build_joint_model(blocks, values).value();
  model.skin_directions = {{"nasion", Eigen::Vector3d(0.0, -0.6, 0.8), 6.0, 1.5}};
  model.bands = {{"nose", 0.8, 1.4, 240}};
  model.provenance = R"({"subjects": 8, "made of": "balls"})";
  return model;
}

}  // namespace skullstation::testing
