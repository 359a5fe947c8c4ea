#include "reconstruction/statistics/build_face_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace skullstation {

namespace {

using Eigen::Index;

constexpr std::size_t least_subjects = 6;
/// Skulls nearer to each other than this are one subject given twice [mm].
constexpr double duplicate_rms_mm = 0.05;

Result<void> check_duplicates(std::span<const ModelSubject> subjects) {
  for (std::size_t i = 0; i < subjects.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const double rms = (subjects[i].skull - subjects[j].skull).norm() /
                         std::sqrt(static_cast<double>(subjects[i].skull.rows()));
      if (rms < duplicate_rms_mm) {
        return fail(ErrorKind::bad_input, "subject " + subjects[i].name,
                    fmt::format("is the same as subject {}", subjects[j].name),
                    "leave one of them out");
      }
    }
  }
  return {};
}

/// "gonion left" of the bone belongs to "gonion skin left".
std::string skin_name(const std::string& bone_name) {
  for (const char* side : {" left", " right"}) {
    if (bone_name.ends_with(side)) {
      return bone_name.substr(0, bone_name.size() - std::string(side).size()) + " skin" + side;
    }
  }
  return bone_name + " skin";
}

std::vector<SkinDirection> skin_directions_of(const SkullTemplate& skull, const HeadTemplate& head,
                                              std::span<const ModelSubject> subjects) {
  std::vector<SkinDirection> directions;
  for (const TemplateLandmark& bone : skull.landmarks) {
    const auto skin =
        std::ranges::find(head.landmarks, skin_name(bone.name), &TemplateLandmark::name);
    if (skin == head.landmarks.end()) continue;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    std::vector<double> depths;
    for (const ModelSubject& subject : subjects) {
      const Eigen::Vector3d way =
          skin->place.position(subject.head) - bone.place.position(subject.skull);
      sum += way.normalized();
      depths.push_back(way.norm());
    }
    const auto count = static_cast<double>(depths.size());
    const Eigen::Map<const Eigen::VectorXd> all(depths.data(), static_cast<Index>(depths.size()));
    const double mean = all.mean();
    const double sd = std::sqrt((all.array() - mean).square().sum() / std::max(1.0, count - 1.0));
    directions.push_back({bone.name, sum.normalized(), mean, sd});
  }
  return directions;
}

}  // namespace

Result<void> FaceModelOptions::validate() const {
  if (const auto sound = skull.validate(); !sound) return forward(sound);
  if (const auto sound = head.validate(); !sound) return forward(sound);
  if (const auto sound = tissue.validate(); !sound) return forward(sound);
  return joint.validate();
}

Result<FaceModel> build_face_model(const SkullTemplate& skull, const HeadTemplate& head,
                                   std::vector<ModelSubject> subjects,
                                   const FaceModelOptions& options, std::string provenance,
                                   const Progress& progress) {
  if (const auto sound = options.validate(); !sound) return forward(sound);
  if (subjects.size() < least_subjects) {
    return fail(
        ErrorKind::bad_input, "face model",
        fmt::format("{} subjects are too few, it takes {}", subjects.size(), least_subjects),
        "add subjects");
  }
  progress.report(0.0, "aligning");
  auto aligned = aligned_population(skull, head, std::move(subjects));
  if (!aligned) return forward(aligned);
  if (const auto sound = check_duplicates(*aligned); !sound) return forward(sound);
  complete_skulls(skull, *aligned);

  progress.report(0.1, "principal components");
  FaceModel model;
  model.skull_template = skull;
  model.head_template = head;
  model.provenance = std::move(provenance);
  std::vector<Points3> skulls;
  std::vector<Points3> heads;
  for (const ModelSubject& subject : *aligned) {
    skulls.push_back(subject.skull);
    heads.push_back(subject.head);
  }
  auto skull_model = build_shape_model(skulls, skull_weights(skull), options.skull);
  if (!skull_model) return forward(skull_model);
  model.skull = *std::move(skull_model);
  auto head_model =
      build_shape_model(heads, vertex_areas({head.vertices, head.triangles, {}, {}}), options.head);
  if (!head_model) return forward(head_model);
  model.head = *std::move(head_model);

  progress.report(0.3, "tissue");
  auto tissue = population_tissue_model(skull, *aligned, options.tissue);
  if (!tissue) return forward(tissue);
  model.tissue = *std::move(tissue);
  auto joint =
      joint_of(model.skull, skulls, model.head, heads, model.tissue, *aligned, options.joint);
  if (!joint) return forward(joint);
  model.joint = *std::move(joint);
  model.skin_directions = skin_directions_of(skull, head, *aligned);

  const auto left_out =
      leave_one_out(skull, head, *aligned, model.tissue, options.joint, progress.part(0.5, 1.0));
  if (!left_out) return forward(left_out);
  model.bands = calibrated_bands(head, *left_out);
  if (const auto sound = model.validate(); !sound) return forward(sound);
  return model;
}

}  // namespace skullstation
