#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "daemon/cli/commands.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/templates/make_templates.h"
#include "reconstruction/templates/template_file.h"

namespace skullstation {

namespace {

/// A colour of its own for each region, darker where `dim`.
Eigen::Matrix<std::uint8_t, 1, 3> region_color(int region, bool dim) {
  const std::uint32_t hash = (static_cast<std::uint32_t>(region) + 1U) * 2654435761U;
  Eigen::Matrix<std::uint8_t, 1, 3> color;
  for (int c = 0; c < 3; ++c) {
    const auto bright = 90U + (hash >> (8 * (c + 1))) % 160U;
    color[c] = static_cast<std::uint8_t>(dim ? bright / 3U : bright);
  }
  return color;
}

}  // namespace

Result<CommandReport> run(const TemplateBuildCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  Templates templates;
  auto skull = make_skull_template(
      {.face_edge_mm = command.skull_edge_mm, .threads = common.threads}, progress.part(0.0, 0.8));
  if (!skull) return forward(skull);
  templates.skull = *std::move(skull);
  auto head = make_head_template({.face_edge_mm = command.head_edge_mm, .threads = common.threads},
                                 progress.part(0.8, 0.95));
  if (!head) return forward(head);
  templates.head = *std::move(head);
  if (auto written = write_templates(templates, command.out); !written) return forward(written);

  const auto outer = std::ranges::count(templates.skull.outer, true);
  if (!command.pictures.empty()) {
    if (auto folder = make_writable_folder(command.pictures); !folder) return forward(folder);
    TriangleMesh bone = surface_of(templates.skull, templates.skull.vertices);
    bone.colors.resize(bone.vertices.rows(), 3);
    for (Eigen::Index v = 0; v < bone.vertices.rows(); ++v) {
      const auto at = static_cast<std::size_t>(v);
      bone.colors.row(v) =
          region_color(static_cast<int>(templates.skull.region[at]), !templates.skull.outer[at]);
    }
    TriangleMesh skin = surface_of(templates.head, templates.head.vertices);
    skin.colors.resize(skin.vertices.rows(), 3);
    for (Eigen::Index v = 0; v < skin.vertices.rows(); ++v) {
      skin.colors.row(v) =
          region_color(static_cast<int>(templates.head.region[static_cast<std::size_t>(v)]), false);
    }
    if (auto written = write_mesh(bone, command.pictures / "skull_template.ply"); !written) {
      return forward(written);
    }
    if (auto written = write_mesh(skin, command.pictures / "head_template.ply"); !written) {
      return forward(written);
    }
  }
  CommandReport report;
  report.text = fmt::format(
      "{}: a skull of {} vertices ({} on its surface, {} of them outside) in {} tetrahedra, {} "
      "landmarks; a head of {} vertices, {} landmarks\n",
      command.out.string(), templates.skull.vertices.rows(), templates.skull.boundary_count, outer,
      templates.skull.tetrahedra.rows(), templates.skull.landmarks.size(),
      templates.head.vertices.rows(), templates.head.landmarks.size());
  report.json = nlohmann::ordered_json{{"file", command.out.string()},
                                       {"skull",
                                        {{"vertices", templates.skull.vertices.rows()},
                                         {"surface_vertices", templates.skull.boundary_count},
                                         {"outer_vertices", outer},
                                         {"tetrahedra", templates.skull.tetrahedra.rows()},
                                         {"landmarks", templates.skull.landmarks.size()}}},
                                       {"head",
                                        {{"vertices", templates.head.vertices.rows()},
                                         {"triangles", templates.head.triangles.rows()},
                                         {"landmarks", templates.head.landmarks.size()}}}}
                    .dump(2);
  return report;
}

}  // namespace skullstation
