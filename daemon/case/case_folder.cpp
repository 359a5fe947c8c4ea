#include "daemon/case/case_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "core/staged_folder.h"
#include "daemon/case/case_report.h"
#include "daemon/report/html_page.h"
#include "daemon/report/pdf_document.h"
#include "reconstruction/io/glb.h"
#include "reconstruction/io/ply.h"

namespace skullstation {

namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double band_colors_mm = 8.0;

Json json_of(const std::optional<double>& value) { return value ? Json(*value) : Json(nullptr); }

std::string case_json(const FaceModel& model, const CaseSkull& skull, const FaceEstimate& face,
                      const CaseSource& source) {
  Json landmarks = Json::array();
  for (const LandmarkDepth& depth : landmark_depths(model, face)) {
    landmarks.push_back({{"name", depth.name},
                         {"depth_mm", depth.depth_mm},
                         {"sd_mm", depth.sd_mm},
                         {"model_mean_mm", depth.model_mean_mm},
                         {"model_sd_mm", depth.model_sd_mm},
                         {"subjects", depth.subjects}});
  }
  Json features = Json::array();
  for (const FeatureFinding& feature : face.features) {
    features.push_back({{"name", feature.name},
                        {"source", feature.source},
                        {"expected_mm", feature.expected_mm},
                        {"sd_mm", json_of(feature.sd_mm)},
                        {"in_face_mm", json_of(feature.in_face_mm)},
                        {"used", feature.used}});
  }
  std::vector<std::string> warnings = skull.warnings;
  warnings.insert(warnings.end(), face.warnings.begin(), face.warnings.end());
  Json variations = Json::array();
  for (const FaceVariation& variation : face.variations) {
    variations.push_back({{"name", variation.name},
                          {"sd_unit", variation.sd_unit},
                          {"refit_gap_mm", variation.refit_gap_mm}});
  }
  return Json{
             {"format", "skullstation-case/1"},
             {"input", {{"file", source.input}, {"sha256", source.input_sha256}}},
             {"model",
              {{"file", source.model},
               {"sha256", source.model_sha256},
               {"card", source.model_card},
               {"subjects", model.joint.subjects}}},
             {"program_version", source.program_version},
             {"seed", source.seed},
             {"facts",
              {{"male", json_of(source.facts.male)},
               {"age_years", json_of(source.facts.age_years)},
               {"body_mass_index", json_of(source.facts.body_mass_index)},
               {"ancestry", source.ancestry.empty() ? Json(nullptr) : Json(source.ancestry)}}},
             {"tissue_from",
              {{"source", source.tissue},
               {"sha256",
                source.tissue_sha256.empty() ? Json(nullptr) : Json(source.tissue_sha256)}}},
             {"anatomical_from_input", matrix_rows(skull.anatomical_from_input.matrix())},
             {"skull_fit",
              {{"facial_mean_mm", skull.quality.facial.mean_mm},
               {"facial_p95_mm", skull.quality.facial.p95_mm},
               {"inverted_tetrahedra", skull.quality.inverted_tetrahedra},
               {"observed_share", skull.quality.observed_share},
               {"mandible_observed_share", skull.quality.mandible_observed_share},
               {"strangeness_sd", skull.strangeness}}},
             {"warnings", warnings},
             {"face", {{"mean_sd_mm", face.sd_mm.mean()}, {"mean_band80_mm", face.band_mm.mean()}}},
             {"features", features},
             {"variations", variations},
             {"tissue", landmarks}}
             .dump(2) +
         "\n";
}

std::string tissue_csv(const FaceModel& model, const FaceEstimate& face) {
  std::string text = "landmark,depth_mm,sd_mm,model_mean_mm,model_sd_mm,subjects,source\n";
  for (const LandmarkDepth& depth : landmark_depths(model, face)) {
    text +=
        fmt::format("{},{:.2f},{:.2f},{:.2f},{:.2f},{},joint model\n", depth.name, depth.depth_mm,
                    depth.sd_mm, depth.model_mean_mm, depth.model_sd_mm, depth.subjects);
  }
  return text;
}

std::string file_name(std::string name) {
  std::ranges::replace(name, ' ', '_');
  std::erase(name, ',');
  return name;
}

TriangleMesh head_mesh(const FaceModel& model, const Points3& vertices) {
  return surface_of(model.head_template, vertices);
}

Result<void> write_uncertainty(const TriangleMesh& head, const FaceEstimate& face,
                               const fs::path& path) {
  TriangleMesh mesh = head;
  mesh.colors = scalar_colors(face.band_mm, 0.0, band_colors_mm);
  Eigen::VectorXd from_bone(head.vertices.rows());
  for (Eigen::Index v = 0; v < from_bone.size(); ++v) {
    from_bone[v] = face.from_bone[static_cast<std::size_t>(v)] ? 1.0 : 0.0;
  }
  return write_ply(mesh, path,
                   {{"sd_mm", face.sd_mm}, {"band80_mm", face.band_mm}, {"from_bone", from_bone}});
}

}  // namespace

std::vector<FaceVariant> face_variants(const FaceEstimate& face, int steps) {
  std::vector<const FaceVariation*> tissue;
  for (const FaceVariation& variation : face.variations) {
    if (variation.name.starts_with("tissue") && tissue.size() < 2) tissue.push_back(&variation);
  }
  constexpr double reach_sd = FaceVariation::reach_sd;
  std::vector<double> sds;
  sds.reserve(static_cast<std::size_t>(steps));
  for (int i = 0; i < steps; ++i) {
    sds.push_back(steps == 1 ? 0.0 : reach_sd * (2.0 * i / (steps - 1) - 1.0));
  }
  std::vector<FaceVariant> variants;
  for (const double second : sds) {
    if (tissue.size() < 2 && second != 0.0) continue;
    for (const double first : sds) {
      if (tissue.empty() && first != 0.0) continue;
      FaceVariant variant{"", face.head};
      if (first != 0.0) {
        variant.name = fmt::format("tissue 1 {:+g}", first);
        variant.head += first * tissue[0]->per_sd_mm;
      }
      if (second != 0.0) {
        variant.name += fmt::format("{}tissue 2 {:+g}", first != 0.0 ? ", " : "", second);
        variant.head += second * tissue[1]->per_sd_mm;
      }
      if (variant.name.empty()) variant.name = "mean";
      variants.push_back(std::move(variant));
    }
  }
  const auto weight = std::ranges::find(face.variations, "body mass index", &FaceVariation::name);
  if (weight != face.variations.end()) {
    variants.push_back({"leaner", face.head - 1.5 * weight->per_sd_mm});
    variants.push_back({"fuller", face.head + 1.5 * weight->per_sd_mm});
  }
  return variants;
}

Result<void> write_case_folder(const FaceModel& model, const CaseSkull& skull,
                               const FaceEstimate& face, const CaseSource& source,
                               const fs::path& folder, const ReportPictureOptions& picture_options,
                               const Progress& progress) {
  if (const auto free = check_new_folder(folder); !free) return forward(free);
  StagedFolder staged(folder);
  if (const auto made = staged.make(); !made) return forward(made);
  if (const auto made = make_writable_folder(staged / "variants"); !made) return forward(made);
  const TriangleMesh bone =
      surface_of(model.skull_template, skull.vertices.topRows(model.skull_template.boundary_count));
  const TriangleMesh head = head_mesh(model, face.head);

  progress.report(0.0, "drawing the face");
  CasePictures pictures;
  auto drawn = face_pictures(head, picture_options);
  if (!drawn) return forward(drawn);
  pictures.face = *std::move(drawn);
  progress.report(0.2, "drawing the method");
  drawn = method_pictures(bone, face.tissue_mm, face.spheres, head, picture_options);
  if (!drawn) return forward(drawn);
  pictures.method = *std::move(drawn);
  progress.report(0.5, "drawing uncertainty and variants");
  drawn = uncertainty_pictures(head, face, band_colors_mm, picture_options);
  if (!drawn) return forward(drawn);
  pictures.uncertainty = *std::move(drawn);
  std::vector<std::pair<std::string, TriangleMesh>> variant_heads;
  for (const FaceVariant& variant : face_variants(face, source.variant_steps)) {
    const TriangleMesh mesh = head_mesh(model, variant.head);
    if (const auto written =
            write_glb(mesh, staged / "variants" / (file_name(variant.name) + ".glb"));
        !written) {
      return forward(written);
    }
    variant_heads.emplace_back(variant.name, mesh);
  }
  drawn = variant_pictures(variant_heads, picture_options);
  if (!drawn) return forward(drawn);
  pictures.variants = *std::move(drawn);
  if (progress.stop.stop_requested()) {
    return fail(ErrorKind::cancelled, folder.string(), "was not written");
  }

  const Report report = case_report(model, skull, face, source, pictures);
  const auto pdf = pdf_document(report);
  if (!pdf) return forward(pdf);

  progress.report(0.9, "writing the case");
  std::vector<MorphTarget> morphs;
  for (const FaceVariation& variation : face.variations) {
    morphs.push_back({variation.name, variation.per_sd_mm});
  }
  for (const auto& written :
       {write_ply(bone, staged / "skull_fitted.ply"), write_ply(head, staged / "head.ply"),
        write_ply(face.spheres, staged / "spheres.ply"),
        write_glb(head, staged / "head.glb", morphs),
        write_uncertainty(head, face, staged / "uncertainty.ply"),
        write_file_durably(staged / "tissue.csv", tissue_csv(model, face)),
        write_file_durably(staged / "case.json", case_json(model, skull, face, source)),
        write_file_durably(staged / "report.html", html_page(report)),
        write_file_durably(staged / "report.pdf", *pdf)}) {
    if (!written) return written;
  }
  for (const auto& [name, picture] : pictures.face) {
    const fs::path file = staged / ("preview_" + file_name(name) + ".png");
    if (const auto written = write_file_durably(file, encode_png(picture)); !written) {
      return forward(written);
    }
  }
  return staged.put_in_place();
}

}  // namespace skullstation
