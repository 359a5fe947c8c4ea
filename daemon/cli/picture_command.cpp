#include <fmt/format.h>

#include <nlohmann/json.hpp>
#include <vector>

#include "core/file.h"
#include "core/session/image_file.h"
#include "daemon/cli/commands.h"
#include "reconstruction/io/mesh_file.h"
#include "reconstruction/rendering/picture_sheet.h"

namespace skullstation {

Result<CommandReport> run(const PictureCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  if (command.out.extension() != ".png") {
    return fail(ErrorKind::usage, command.out.string(), "a picture's name ends in .png");
  }
  const Result<TriangleMesh> mesh = read_mesh(command.mesh);
  if (!mesh) return forward(mesh);
  TriangleMesh outer;
  std::vector<PicturedMesh> meshes = {{&*mesh}};
  if (!command.over.empty()) {
    Result<TriangleMesh> read = read_mesh(command.over);
    if (!read) return forward(read);
    outer = *std::move(read);
    meshes.push_back({&outer, skin_color, 0.35});
  }

  std::vector<PictureSide> sides;
  for (const PictureSide& side : head_sides()) {
    if (command.side.empty() || command.side == side.name) sides.push_back(side);
  }
  PictureOptions options;
  options.width = options.height = command.size_px;
  options.threads = common.threads;
  std::vector<Image8> pictures;
  progress.report(0.0, "drawing");
  const Result<std::vector<Image8>> drawn = render_sides(meshes, sides, options);
  if (!drawn) return forward(drawn);
  const Image8 sheet = picture_sheet(*drawn, 4);
  if (Result<void> written = write_file_durably(command.out, encode_png(sheet)); !written) {
    return forward(written);
  }

  CommandReport report;
  report.text = fmt::format("{}: {} of {}, {} triangles\n", command.out.string(),
                            command.side.empty() ? "eight sides" : command.side,
                            command.mesh.string(), mesh->triangles.rows());
  report.json =
      nlohmann::ordered_json{
          {"picture", command.out.string()}, {"width", sheet.width}, {"height", sheet.height}}
          .dump(2);
  return report;
}

}  // namespace skullstation
