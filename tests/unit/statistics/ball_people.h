#pragma once

#include <Eigen/Geometry>

#include "core/random.h"
#include "reconstruction/statistics/population.h"
#include "tests/unit/statistics/small_face_model.h"

namespace skullstation::testing {

inline const SkullTemplate& skull_template() {
  static const SkullTemplate skull = ball_skull(80.0);
  return skull;
}

inline const HeadTemplate& head_template() {
  static const HeadTemplate head = ball_head(90.0);
  return head;
}

/// A person whose head is the skull, wider and longer as the skull is, plus tissue that grows with
/// the body mass index; turned and moved at random.
inline ModelSubject person(int number) {
  Random random(mix(99, static_cast<std::uint64_t>(number)));
  const double width = random.normal();
  const double length = random.normal();
  const double bmi = random.normal(25.0, 4.0);
  const double tissue_mm = 8.0 + 0.5 * (bmi - 25.0) + 0.2 * random.normal();
  const auto shaped = [&](const Points3& ball) {
    Points3 points = ball;
    points.col(0) *= 1.0 + 0.05 * width;
    points.col(1) *= 1.0 + 0.04 * length;
    return points;
  };
  ModelSubject subject;
  subject.name = "P" + std::to_string(number);
  subject.skull = shaped(skull_template().vertices);
  subject.head = shaped(skull_template().vertices.topRows(head_template().vertices.rows()));
  subject.head += tissue_mm * subject.head.rowwise().normalized();
  for (double& x : subject.skull.reshaped()) x += 0.1 * random.normal();
  subject.skull_observed.assign(static_cast<std::size_t>(skull_template().boundary_count), true);
  subject.tissue_mm = Eigen::VectorXd::Constant(skull_template().boundary_count, tissue_mm);
  subject.facts.male = random.uniform() < 0.5 ? 1.0 : 0.0;
  subject.facts.age_years = random.uniform(20.0, 80.0);
  subject.facts.body_mass_index = bmi;
  const Eigen::AngleAxisd turn(0.3 * random.normal(), Eigen::Vector3d::UnitZ());
  const Eigen::RowVector3d shift(random.normal(), 5.0 * random.normal(), random.normal());
  for (Points3* points : {&subject.skull, &subject.head}) {
    *points = ((turn.toRotationMatrix() * points->transpose()).transpose()).eval();
    points->rowwise() += shift;
  }
  return subject;
}

inline std::vector<ModelSubject> people(int count) {
  std::vector<ModelSubject> result;
  for (int i = 0; i < count; ++i) result.push_back(person(i));
  return result;
}

}  // namespace skullstation::testing
