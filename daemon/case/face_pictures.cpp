#include "daemon/case/face_pictures.h"

#include <array>
#include <cmath>

namespace skullstation {

namespace {

PicturedMesh skin_of(const TriangleMesh& head) {
  PicturedMesh mesh;
  mesh.mesh = &head;
  mesh.color = skin_color;
  return mesh;
}

}  // namespace

Result<CaptionedPictures> face_pictures(const TriangleMesh& head,
                                        const ReportPictureOptions& options) {
  const PicturedMesh mesh = skin_of(head);
  CaptionedPictures pictures;
  const auto done = add_sides(
      pictures, std::span(&mesh, 1),
      {"front", "left three-quarter", "right three-quarter", "left", "right"}, "", options);
  if (!done) return forward(done);
  return pictures;
}

Result<CaptionedPictures> method_pictures(const TriangleMesh& skull,
                                          const Eigen::VectorXd& tissue_mm,
                                          const TriangleMesh& spheres, const TriangleMesh& head,
                                          const ReportPictureOptions& options) {
  PicturedMesh bone;
  bone.mesh = &skull;
  TriangleMesh coloured = skull;
  coloured.colors = scalar_colors(tissue_mm, 2.0, 25.0);
  PicturedMesh tissue;
  tissue.mesh = &coloured;
  PicturedMesh sphere_model;
  sphere_model.mesh = &spheres;
  sphere_model.color = {0.70, 0.78, 0.84};
  PicturedMesh face = skin_of(head);
  face.opacity = 0.45;
  const std::array together = {bone, face};
  CaptionedPictures pictures;
  const auto add = [&](std::span<const PicturedMesh> meshes, const char* caption) {
    return add_sides(pictures, meshes, {"front", "left"}, caption, options);
  };
  for (const auto& done :
       {add(std::span(&bone, 1), "fitted skull"),
        add(std::span(&tissue, 1), "soft tissue, 2 to 25 mm"),
        add(std::span(&sphere_model, 1), "sphere model"), add(together, "skull in the face")}) {
    if (!done) return forward(done);
  }
  return pictures;
}

Result<CaptionedPictures> uncertainty_pictures(const TriangleMesh& head, const FaceEstimate& face,
                                               double high_mm,
                                               const ReportPictureOptions& options) {
  Eigen::VectorXd values = face.band_mm;
  for (Eigen::Index v = 0; v < values.size(); ++v) {
    if (!face.from_bone[static_cast<std::size_t>(v)]) values[v] = std::nan("");
  }
  TriangleMesh coloured = head;
  coloured.colors = scalar_colors(values, 0.0, high_mm);
  PicturedMesh mesh;
  mesh.mesh = &coloured;
  CaptionedPictures pictures;
  const auto done = add_sides(pictures, std::span(&mesh, 1),
                              {"front", "left three-quarter", "right three-quarter"}, "", options);
  if (!done) return forward(done);
  return pictures;
}

Result<CaptionedPictures> variant_pictures(
    const std::vector<std::pair<std::string, TriangleMesh>>& heads,
    const ReportPictureOptions& options) {
  CaptionedPictures pictures;
  for (const auto& [name, head] : heads) {
    const PicturedMesh mesh = skin_of(head);
    const auto done = add_sides(pictures, std::span(&mesh, 1), {"front"}, name, options);
    if (!done) return forward(done);
    pictures.back().first = name;
  }
  return pictures;
}

}  // namespace skullstation
