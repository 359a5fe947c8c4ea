#include "daemon/subject/subject_json.h"

#include <nlohmann/json.hpp>

namespace skullstation {

namespace {

using Json = nlohmann::ordered_json;

Json json_of(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

Json text_or_null(const std::string& text) { return text.empty() ? Json() : Json(text); }

template <class T>
Json value_or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const TriangleMesh& mesh, int components, bool closed_manifold) {
  return {{"vertices", mesh.vertices.rows()},
          {"triangles", mesh.triangles.rows()},
          {"area_mm2", surface_area(mesh)},
          {"components", components},
          {"closed_manifold", closed_manifold}};
}

Json json_of(const PatientIdentity& identity) {
  return {{"name", identity.name},
          {"id", identity.id},
          {"birth_date", identity.birth_date},
          {"study_date", identity.study_date},
          {"study_uid", identity.study_uid},
          {"series_uid", identity.series_uid},
          {"series_description", identity.series_description}};
}

}  // namespace

std::string quality_json(const CtSurfaces& surfaces) {
  const CtQuality& q = surfaces.quality;
  Json warnings = Json::array();
  for (const CtFinding& finding : q.findings) {
    warnings.push_back({{"warning", to_string(finding.warning)}, {"text", finding.text}});
  }
  Json streaks = Json::array();
  for (const StreakedSlices& stack : q.streaks) streaks.push_back({stack.first, stack.last});
  Json skull = json_of(surfaces.skull, q.skull_components, q.skull_closed_manifold);
  skull["openings"] = q.skull_openings;
  Json json = {{"format", "skullstation-ct-quality/1"},
               {"warnings", warnings},
               {"spacing_mm", json_of(q.spacing_mm)},
               {"skull", skull},
               {"skin", json_of(surfaces.skin, q.skin_components, q.skin_closed_manifold)},
               {"bone_parts_kept", q.bone_parts_kept},
               {"bone_parts_removed", q.bone_parts_removed},
               {"mandible_apart", q.mandible_apart},
               {"mandible_most_posterior_mm",
                q.mandible_most_posterior_mm ? json_of(*q.mandible_most_posterior_mm) : Json()},
               {"crop_z_mm", value_or_null(q.crop_z_mm)},
               {"spine_removed_mm3", q.spine_removed_mm3},
               {"surroundings_removed_mm3", q.surroundings_removed_mm3},
               {"contact_front_mm2", q.contact_front_mm2},
               {"contact_back_mm2", q.contact_back_mm2},
               {"streaked_slices", streaks}};
  return json.dump(2) + "\n";
}

std::string subject_json(const SubjectSource& source, const CtQuality& quality) {
  const VolumeInfo& info = source.info;
  const CtSurfaceOptions& o = source.options;
  Json json = {
      {"format", "skullstation-subject/1"},
      {"frame", "patient"},
      {"unit", "mm"},
      {"sex", text_or_null(info.sex)},
      {"age_years", value_or_null(info.age_years)},
      {"bmi", value_or_null(info.body_mass_index)},
      {"scan",
       {{"format", info.format},
        {"sha256", source.sha256},
        {"voxels", {source.grid.size.x(), source.grid.size.y(), source.grid.size.z()}},
        {"spacing_mm", json_of(source.grid.spacing_mm)},
        {"slice_thickness_mm", value_or_null(info.slice_thickness_mm)},
        {"manufacturer", text_or_null(info.manufacturer)},
        {"scanner_model", text_or_null(info.scanner_model)},
        {"convolution_kernel", text_or_null(info.convolution_kernel)},
        {"tube_voltage_kv", value_or_null(info.tube_voltage_kv)},
        {"corrections", info.warnings}}},
      {"thresholds", {{"skin_hu", o.skin_hu}, {"bone_hu", o.bone_hu}, {"metal_hu", o.metal_hu}}},
      {"crop_z_mm", value_or_null(quality.crop_z_mm)},
      {"options",
       {{"crop", o.crop},
        {"crop_below_mandible_mm", o.crop_below_mandible_mm},
        {"edge_mm", o.decimation.edge_mm},
        {"max_error_mm", o.decimation.max_error_mm},
        {"longest_spike_mm", o.longest_spike_mm},
        {"closing_radius_mm", o.seal.closing_radius_mm},
        {"seal_depth_mm", o.seal.depth_mm}}},
      {"program", {{"name", "skullstation"}, {"version", source.program_version}}}};
  if (info.identity) json["identity"] = json_of(*info.identity);
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace skullstation
