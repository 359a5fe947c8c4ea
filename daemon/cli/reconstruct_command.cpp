#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/file.h"
#include "core/session/image_file.h"
#include "core/staged_folder.h"
#include "daemon/cli/commands.h"
#include "reconstruction/io/glb.h"
#include "reconstruction/io/ply.h"
#include "reconstruction/photogrammetry/quality_report.h"
#include "reconstruction/rendering/picture_sheet.h"

namespace skullstation {

namespace fs = std::filesystem;

namespace {

ReconstructionOptions options_of(const ReconstructCommand& command, const CommonOptions& common) {
  ReconstructionOptions options;
  options.threads = common.threads;
  options.seed = common.seed;
  if (command.poses == "board") options.poses.method = PoseMethod::board;
  if (command.poses == "given") options.poses.method = PoseMethod::given;
  if (command.poses == "sfm") options.poses.method = PoseMethod::motion;
  options.poses.motion.camera_radius_mm = command.camera_radius_mm;
  options.closed_rim_mm = command.close_holes_mm;
  if (command.quality == "draft") options.quality = ReconstructionQuality::draft;
  if (command.quality == "fine") options.quality = ReconstructionQuality::fine;
  return options;
}

Result<std::vector<Image8>> eight_sides(const TriangleMesh& mesh, int size_px, int threads) {
  const PicturedMesh pictured{&mesh};
  PictureOptions options;
  options.width = options.height = size_px;
  options.samples = 4;
  options.threads = threads;
  return render_sides({&pictured, 1}, head_sides(), options);
}

Result<void> write_previews(const TriangleMesh& mesh, const fs::path& folder, int threads) {
  constexpr int size_px = 600;
  const auto pictures = eight_sides(mesh, size_px, threads);
  if (!pictures) return forward(pictures);
  for (std::size_t i = 0; i < pictures->size(); ++i) {
    std::string name = head_sides()[i].name;
    std::ranges::replace(name, ' ', '_');
    const auto written = write_file_durably(folder / fmt::format("preview_{}.png", name),
                                            encode_png((*pictures)[i]));
    if (!written) return written;
  }
  return {};
}

/// With its texture where there is one; without, with its vertices' colours.
Result<void> write_model(const ReconstructedSurface& surface, const fs::path& path) {
  constexpr int texture_quality = 92;
  if (!surface.textured) return write_glb(surface.mesh, path);
  const TexturedSurface& textured = *surface.textured;
  return write_glb(textured.mesh,
                   {textured.coordinates, encode_jpeg(textured.atlas, texture_quality)}, path);
}

/// With a mark at each vertex that is a guess, where there may be such.
Result<void> write_surface(const ReconstructedSurface& surface, const fs::path& path) {
  const std::vector<bool>& filled = surface.filled.vertices;
  if (filled.empty()) return write_ply(surface.mesh, path);
  VertexScalar mark{"filled", Eigen::VectorXd(surface.mesh.vertices.rows())};
  for (std::size_t v = 0; v < filled.size(); ++v) {
    mark.values[static_cast<Eigen::Index>(v)] = filled[v] ? 1.0 : 0.0;
  }
  return write_ply(surface.mesh, path, {mark});
}

/// All sides of a coloured mesh in one picture.
Result<void> write_sheet(const TriangleMesh& mesh, const fs::path& file, int threads) {
  constexpr int size_px = 320;
  const auto pictures = eight_sides(mesh, size_px, threads);
  if (!pictures) return forward(pictures);
  return write_file_durably(file, encode_png(picture_sheet(*pictures, 4)));
}

Result<void> write_parts(const SessionReconstruction& reconstruction, const fs::path& folder,
                         int threads) {
  const TriangleMesh& mesh = reconstruction.surface.mesh;
  const Coverage& coverage = reconstruction.surface.coverage;
  const TriangleMesh by_coverage = colored_by_coverage(mesh, coverage.views);
  const auto cameras = format_session(reconstruction.cameras);
  if (!cameras) return forward(cameras);
  for (const auto& written :
       {write_surface(reconstruction.surface, folder / "skull.ply"),
        write_model(reconstruction.surface, folder / "skull.glb"),
        write_ply(by_coverage, folder / "coverage.ply"),
        write_file_durably(folder / "cameras.json", *cameras),
        write_file_durably(folder / "quality.json", quality_json(reconstruction)),
        write_previews(mesh, folder, threads),
        write_sheet(by_coverage, folder / "quality_coverage.png", threads),
        write_sheet(colored_by_accuracy(mesh, coverage.accuracy_mm),
                    folder / "quality_accuracy.png", threads)}) {
    if (!written) return written;
  }
  return {};
}

Result<void> write_reconstruction(const SessionReconstruction& reconstruction, const fs::path& out,
                                  int threads) {
  StagedFolder staged(out);
  if (const auto made = staged.make(); !made) return made;
  if (const auto written = write_parts(reconstruction, staged.path(), threads); !written) {
    return written;
  }
  return staged.put_in_place();
}

CommandReport report_of(const SessionReconstruction& reconstruction, const fs::path& out) {
  const QualityFigures figures = quality_figures(reconstruction);
  const PoseResult& poses = reconstruction.poses;
  CommandReport report;
  report.text = fmt::format(
      "{}: {} triangles from {} of {} views, estimated accuracy {:.2f} mm, scale from {}",
      (out / "skull.ply").string(), reconstruction.surface.mesh.triangles.rows(),
      figures.views_used, figures.views, figures.accuracy_mm, to_string(poses.scale));
  const std::vector<std::string> verdicts = quality_verdicts(reconstruction, figures);
  for (const std::string& verdict : verdicts) report.text += "\n" + verdict;
  report.json = nlohmann::ordered_json{
      {"reconstruction", out.string()},
      {"views", figures.views},
      {"views_used", figures.views_used},
      {"triangles", reconstruction.surface.mesh.triangles.rows()},
      {"area_cm2", figures.area_cm2},
      {"reprojection_rms_px", poses.rms_px},
      {"accuracy_mm", figures.accuracy_mm},
      {"scale_source", to_string(poses.scale)},
      {"scale_error_percent", poses.scale_error_percent},
      {"verdicts",
       verdicts}}.dump(2);
  return report;
}

}  // namespace

Result<CommandReport> run(const ReconstructCommand& command, const CommonOptions& common,
                          const Progress& progress) {
  if (const auto fresh = check_new_folder(command.out); !fresh) return forward(fresh);
  const auto session = read_session(command.session);
  if (!session) return forward(session);
  if (session->views.empty()) {
    return fail(ErrorKind::bad_input, command.session.string(), "lists no views");
  }
  const auto photographs =
      read_photographs(*session, command.session, common.threads, progress.part(0.0, 0.05));
  if (!photographs) return forward(photographs);
  const auto masks = read_given_masks(*session, command.session);
  if (!masks) return forward(masks);
  const auto reconstruction = reconstruct_session(
      *session, *photographs, *masks, options_of(command, common), progress.part(0.05, 0.95));
  if (!reconstruction) return forward(reconstruction);
  progress.report(0.95, "writing");
  if (const auto written = write_reconstruction(*reconstruction, command.out, common.threads);
      !written) {
    return forward(written);
  }
  return report_of(*reconstruction, command.out);
}

}  // namespace skullstation
