#include "daemon/subject/subject_report.h"

#include <fmt/format.h>

#include "daemon/report/html_page.h"
#include "daemon/subject/subject_pictures.h"
#include "reconstruction/rendering/mesh_picture.h"

namespace skullstation {

namespace {

std::string surface_in_words(const TriangleMesh& mesh, int components, bool closed) {
  return fmt::format("{} vertices, {} triangles, {:.0f} cm^2, {} {}, {}", mesh.vertices.rows(),
                     mesh.triangles.rows(), surface_area(mesh) / 100.0, components,
                     components == 1 ? "piece" : "pieces",
                     closed ? "watertight and manifold" : "NOT watertight");
}

std::string in_words(const std::optional<double>& value, const char* format, const char* nothing) {
  return value ? fmt::format(fmt::runtime(format), *value) : nothing;
}

void add_findings(Report& report, const CtSurfaces& surfaces, const SubjectSource& source) {
  report.add(Heading{"Is the scan fit for model generation?"});
  const auto& findings = surfaces.quality.findings;
  if (findings.empty()) report.add(Paragraph{"Nothing was found that speaks against it."});
  for (const CtFinding& finding : findings) {
    report.add(Warning{to_string(finding.warning), finding.text});
  }
  for (const std::string& correction : source.info.warnings) {
    report.add(Warning{"while reading", correction});
  }
  report.add(Paragraph{fmt::format(
      "Thin bone: walls thinner than about two voxels (orbital floor and medial wall, ethmoid, "
      "nasal conchae, parts of the maxillary sinus) do not reach {} HU. They are open or too thin "
      "in the bone surface, which has {} such openings; measure nothing there.",
      source.options.bone_hu, surfaces.quality.skull_openings)});
}

void add_figures(Report& report, const CtSurfaces& surfaces) {
  const CtQuality& q = surfaces.quality;
  report.add(Heading{"Figures"});
  report.add(Table{
      {{"skull", surface_in_words(surfaces.skull, q.skull_components, q.skull_closed_manifold)},
       {"skin", surface_in_words(surfaces.skin, q.skin_components, q.skin_closed_manifold)},
       {"bone parts", fmt::format("{} kept{}, {} removed", q.bone_parts_kept,
                                  q.mandible_apart ? " (the mandible is one of its own)" : "",
                                  q.bone_parts_removed)},
       {"spine removed", fmt::format("{:.1f} ml", q.spine_removed_mm3 / 1000.0)},
       {"head rest, table and cables removed",
        fmt::format("{:.0f} ml", q.surroundings_removed_mm3 / 1000.0)},
       {"they touched the head on", fmt::format("{:.0f} mm^2 in front, {:.0f} mm^2 behind",
                                                q.contact_front_mm2, q.contact_back_mm2)},
       {"cropped at", in_words(q.crop_z_mm, "z = {:.1f} mm", "not cropped")}}});
}

void add_source(Report& report, const SubjectSource& source) {
  const VolumeInfo& info = source.info;
  const CtSurfaceOptions& o = source.options;
  const auto known = [](const std::string& text) { return text.empty() ? "not stated" : text; };
  report.add(Heading{"Scan and options"});
  std::vector<std::pair<std::string, std::string>> rows = {
      {"scan", fmt::format("{}, {} x {} x {} voxels of {:.3f} x {:.3f} x {:.3f} mm", info.format,
                           source.grid.size.x(), source.grid.size.y(), source.grid.size.z(),
                           source.grid.spacing_mm.x(), source.grid.spacing_mm.y(),
                           source.grid.spacing_mm.z())},
      {"SHA-256 of its voxels and geometry", source.sha256},
      {"scanner",
       known(info.manufacturer + (info.scanner_model.empty() ? "" : " ") + info.scanner_model)},
      {"kernel", known(info.convolution_kernel)},
      {"sex, age",
       fmt::format("{}, {}", known(info.sex),
                   info.age_years ? fmt::format("{} years", *info.age_years) : "not stated")},
      {"skin, bone, metal from", fmt::format("{}, {}, {} HU", o.skin_hu, o.bone_hu, o.metal_hu)},
      {"mean edge", fmt::format("{:.2f} mm, moved by at most {:.2f} mm", o.decimation.edge_mm,
                                o.decimation.max_error_mm)},
      {"made by", "skullstation " + source.program_version}};
  if (info.identity) {
    rows.insert(rows.begin(), {"patient (identity kept on request)",
                               fmt::format("{}, {}", info.identity->name, info.identity->id)});
  }
  report.add(Table{rows});
}

}  // namespace

Result<std::string> subject_report(const CtSurfaces& surfaces, const SubjectSource& source,
                                   int threads) {
  const auto skull = surface_pictures(surfaces.skull, PicturedMesh{}.color, threads);
  if (!skull) return forward(skull);
  const auto skin = surface_pictures(surfaces.skin, skin_color, threads);
  if (!skin) return forward(skin);
  Report report{"Bone and skin from CT", {}};
  add_findings(report, surfaces, source);
  report.add(Heading{"Skull"});
  report.add(Pictures{*skull});
  report.add(Heading{"Skin"});
  report.add(Pictures{*skin});
  report.add(Heading{"Slices: orange the bone surface, blue the skin surface"});
  report.add(Paragraph{
      "Axial slices are seen from the feet, coronal ones from the front: the patient's left is on "
      "the right. Slices are counted from the feet, from the front and from the right."});
  report.add(Pictures{slice_pictures(surfaces, threads)});
  add_figures(report, surfaces);
  add_source(report, source);
  return html_page(report);
}

}  // namespace skullstation
