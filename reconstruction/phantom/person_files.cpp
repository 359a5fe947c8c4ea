#include "reconstruction/phantom/person_files.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/file.h"
#include "reconstruction/distance/triangle_bvh.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/phantom/thickness_table.h"

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Json landmark_json(const Landmark& landmark) {
  std::string name = landmark.name;
  std::string side = "median";
  for (const std::string_view of : {"left", "right"}) {
    if (!name.ends_with(std::string(" ").append(of))) continue;
    name.resize(name.size() - of.size() - 1);
    side = of;
  }
  const Eigen::Vector3d& p = landmark.position_mm;
  return {{"name", name}, {"side", side}, {"position", {p.x(), p.y(), p.z()}}, {"sd_mm", 0.0}};
}

std::string landmarks_json(const Person& person) {
  Json landmarks = Json::array();
  for (const Landmark& landmark : person.bone.landmarks) {
    landmarks.push_back(landmark_json(landmark));
  }
  for (const Landmark& landmark : person.face.landmarks) {
    landmarks.push_back(landmark_json(landmark));
  }
  return Json{{"frame", "anatomical"}, {"landmarks", landmarks}}.dump(2) + "\n";
}

const char* sex_name(Sex sex) { return sex == Sex::male ? "male" : "female"; }

std::string subject_json(const Person& person) {
  const PersonParameters& parameters = person.parameters;
  return Json{{"synthetic", true},
              {"sex", sex_name(parameters.sex)},
              {"age_years", parameters.age_years},
              {"bmi", parameters.bmi},
              {"frame", "anatomical"},
              {"provenance",
               {{"made_by", "skullstation phantom"}, {"person_seed", parameters.seed}}}}
             .dump(2) +
         "\n";
}

std::string truth_json(const Person& person) {
  const PersonParameters& parameters = person.parameters;
  Json measures = Json::object();
  const auto table = craniometric_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    measures[std::string(table[i].code)] = {{"name", table[i].name},
                                            {"drawn_mm", parameters.craniometrics_mm[i]},
                                            {"measured_mm", person.bone.measures_mm[i]}};
  }
  const FeatureResiduals& features = parameters.features;
  return Json{{"seed", parameters.seed},
              {"sex", sex_name(parameters.sex)},
              {"age_years", parameters.age_years},
              {"bmi", parameters.bmi},
              {"mandible_opening_deg", parameters.mandible_opening_deg},
              {"missing_teeth", parameters.missing_teeth},
              {"cranium_vertices", person.cranium_vertices},
              {"bone_freedom", parameters.bone_freedom},
              {"tissue_freedom", parameters.tissue_freedom},
              {"craniometrics", measures},
              {"residuals_mm",
               {{"pronasale_forward", features.pronasale_forward_mm},
                {"pronasale_down", features.pronasale_down_mm},
                {"alar_width", features.alar_width_mm},
                {"mouth_width", features.mouth_width_mm},
                {"ear_length", features.ear_length_mm},
                {"ear_protrusion", features.ear_protrusion_mm}}},
              {"bone_warp",
               {{"least_determinant", person.bone.least_determinant},
                {"shrinkings", person.bone.shrinkings}}},
              {"face_warp",
               {{"least_determinant", person.face.least_determinant},
                {"least_thickness_mm", person.face.least_thickness_mm},
                {"shrinkings", person.face.shrinkings}}}}
             .dump(2) +
         "\n";
}

std::string thickness_csv(const Person& person) {
  const TriangleBvh skin(person.skin);
  std::string csv = "pair,side,drawn_mm,between_landmarks_mm,closest_mm\n";
  const auto table = thickness_table();
  const auto add = [&](const TissueThickness& row, const char* side, const std::string& landmark,
                       double drawn_mm, double between_mm) {
    const Eigen::Vector3d bone =
        person.bone.landmarks[landmark_index(person.bone.landmarks, landmark)].position_mm;
    csv += fmt::format("{},{},{:.3f},{:.3f},{:.3f}\n", row.pair, side, drawn_mm, between_mm,
                       skin.closest(bone).distance_mm);
  };
  for (std::size_t i = 0; i < table.size(); ++i) {
    const ThicknessPair& drawn = person.parameters.thickness_mm[i];
    const ThicknessPair& between = person.face.thickness_mm[i];
    const std::string bone(table[i].bone);
    if (!table[i].bilateral) {
      add(table[i], "median", bone, drawn.left_mm, between.left_mm);
      continue;
    }
    add(table[i], "left", bone + " left", drawn.left_mm, between.left_mm);
    add(table[i], "right", bone + " right", drawn.right_mm, between.right_mm);
  }
  return csv;
}

}  // namespace

Result<void> write_person(const Person& person, const std::filesystem::path& folder) {
  if (auto made = make_writable_folder(folder); !made) return made;
  if (auto written = write_mesh(person.skull, folder / "skull.ply"); !written) return written;
  if (auto written = write_mesh(person.skin, folder / "skin.ply"); !written) return written;
  const std::pair<const char*, std::string> files[] = {{"landmarks.json", landmarks_json(person)},
                                                       {"subject.json", subject_json(person)},
                                                       {"thickness.csv", thickness_csv(person)},
                                                       {"truth.json", truth_json(person)}};
  for (const auto& [name, text] : files) {
    if (auto written = write_file_durably(folder / name, text); !written) return written;
  }
  return {};
}

}  // namespace skullstation
