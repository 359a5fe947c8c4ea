#include "daemon/case/face_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>

#include "reconstruction/rendering/mesh_picture.h"
#include "reconstruction/rendering/picture_sheet.h"

namespace skullstation {

namespace {

PictureOptions picture_options(const FacePictureOptions& of) {
  PictureOptions options;
  options.width = of.width_px;
  options.height = of.width_px;
  options.samples = of.samples;
  options.threads = of.threads;
  return options;
}

std::vector<PictureSide> sides_named(std::initializer_list<std::string_view> names) {
  std::vector<PictureSide> sides;
  for (const std::string_view name : names) {
    for (const PictureSide& side : head_sides()) {
      if (name == side.name) sides.push_back(side);
    }
  }
  return sides;
}

/// Adds pictures of the meshes from the sides to `pictures`.
Result<void> add(CaptionedPictures& pictures, std::span<const PicturedMesh> meshes,
                 const std::vector<PictureSide>& sides, const std::string& caption,
                 const FacePictureOptions& options) {
  auto rendered = render_sides(meshes, sides, picture_options(options));
  if (!rendered) return forward(rendered);
  for (std::size_t i = 0; i < sides.size(); ++i) {
    pictures.emplace_back(caption.empty() ? sides[i].name : caption + ", " + sides[i].name,
                          std::move((*rendered)[i]));
  }
  return {};
}

}  // namespace

Colors scalar_colors(const Eigen::VectorXd& values, double low, double high) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  Colors colors(values.size(), 3);
  for (Eigen::Index v = 0; v < values.size(); ++v) {
    if (std::isnan(values[v])) {
      colors.row(v).setConstant(150);
      continue;
    }
    const double at = std::clamp((values[v] - low) / (high - low), 0.0, 1.0) * (stops.size() - 1.0);
    const auto stop = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const double share = at - static_cast<double>(stop);
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      colors(v, c) = static_cast<std::uint8_t>(
          std::lround((1.0 - share) * stops[stop][channel] + share * stops[stop + 1][channel]));
    }
  }
  return colors;
}

Result<CaptionedPictures> face_pictures(const TriangleMesh& head,
                                        const FacePictureOptions& options) {
  PicturedMesh mesh;
  mesh.mesh = &head;
  mesh.color = skin_color;
  CaptionedPictures pictures;
  const auto sides =
      sides_named({"front", "left three-quarter", "right three-quarter", "left", "right"});
  if (const auto done = add(pictures, std::span(&mesh, 1), sides, "", options); !done) {
    return forward(done);
  }
  return pictures;
}

Result<CaptionedPictures> method_pictures(const TriangleMesh& skull,
                                          const Eigen::VectorXd& tissue_mm,
                                          const TriangleMesh& spheres, const TriangleMesh& head,
                                          const FacePictureOptions& options) {
  const auto sides = sides_named({"front", "left"});
  PicturedMesh bone;
  bone.mesh = &skull;
  TriangleMesh coloured = skull;
  coloured.colors = scalar_colors(tissue_mm, 2.0, 25.0);
  PicturedMesh tissue;
  tissue.mesh = &coloured;
  PicturedMesh sphere_model;
  sphere_model.mesh = &spheres;
  sphere_model.color = {0.70, 0.78, 0.84};
  PicturedMesh face;
  face.mesh = &head;
  face.color = skin_color;
  face.opacity = 0.45;
  const std::array together = {bone, face};
  CaptionedPictures pictures;
  for (const auto& done :
       {add(pictures, std::span(&bone, 1), sides, "fitted skull", options),
        add(pictures, std::span(&tissue, 1), sides, "soft tissue, 2 to 25 mm", options),
        add(pictures, std::span(&sphere_model, 1), sides, "sphere model", options),
        add(pictures, together, sides, "skull in the face", options)}) {
    if (!done) return forward(done);
  }
  return pictures;
}

Result<CaptionedPictures> uncertainty_pictures(const TriangleMesh& head, const FaceEstimate& face,
                                               double high_mm, const FacePictureOptions& options) {
  Eigen::VectorXd values = face.band_mm;
  for (Eigen::Index v = 0; v < values.size(); ++v) {
    if (!face.from_bone[static_cast<std::size_t>(v)]) values[v] = std::nan("");
  }
  TriangleMesh coloured = head;
  coloured.colors = scalar_colors(values, 0.0, high_mm);
  PicturedMesh mesh;
  mesh.mesh = &coloured;
  CaptionedPictures pictures;
  const auto sides = sides_named({"front", "left three-quarter", "right three-quarter"});
  if (const auto done = add(pictures, std::span(&mesh, 1), sides, "", options); !done) {
    return forward(done);
  }
  return pictures;
}

Result<CaptionedPictures> variant_pictures(
    const std::vector<std::pair<std::string, TriangleMesh>>& heads,
    const FacePictureOptions& options) {
  CaptionedPictures pictures;
  const auto sides = sides_named({"front"});
  for (const auto& [name, head] : heads) {
    PicturedMesh mesh;
    mesh.mesh = &head;
    mesh.color = skin_color;
    auto rendered = render_sides(std::span(&mesh, 1), sides, picture_options(options));
    if (!rendered) return forward(rendered);
    pictures.emplace_back(name, std::move(rendered->front()));
  }
  return pictures;
}

}  // namespace skullstation
