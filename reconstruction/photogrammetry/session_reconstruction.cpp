#include "reconstruction/photogrammetry/session_reconstruction.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "core/parallel.h"
#include "core/session/board_pose.h"
#include "core/session/image_file.h"
#include "reconstruction/photogrammetry/masks.h"
#include "reconstruction/photogrammetry/surface_extraction.h"

namespace skullstation {

namespace {

constexpr std::size_t least_views = 3;

std::size_t camera_index(const Session& session, const SessionView& view) {
  return static_cast<std::size_t>(
      std::ranges::find(session.cameras, view.camera, &SessionCamera::id) -
      session.cameras.begin());
}

/// How the camera stands to the board, if the view shows it.
std::optional<Rigid3> camera_from_board(const Session& session, const PoseResult& poses,
                                        const PoseObservation& observation, const ViewPose& pose,
                                        const Lens& lens) {
  if (!session.board) return std::nullopt;
  if (poses.scale == ScaleSource::board) {
    return pose.camera_from_table * poses.table_from_board(observation.pass);
  }
  const auto found = find_board_pose(observation.corners, *session.board, lens);
  return found ? std::optional(found->camera_from_board) : std::nullopt;
}

/// Indices of the views used, by pass.
std::map<int, std::vector<std::size_t>> used_by_pass(const Session& session,
                                                     const PoseResult& poses) {
  std::map<int, std::vector<std::size_t>> passes;
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    if (poses.views[i].used()) passes[session.views[i].pass].push_back(i);
  }
  return passes;
}

Result<void> check_enough(const Session& session, const PoseResult& poses) {
  std::string dropped;
  for (const ViewPose& view : poses.views) {
    if (!view.used()) dropped += fmt::format("\n  {}: {}", view.name, view.dropped);
  }
  const auto used = used_by_pass(session, poses);
  for (const SessionView& view : session.views) {
    const auto of_pass = used.find(view.pass);
    const std::size_t count = of_pass == used.end() ? 0 : of_pass->second.size();
    if (count >= least_views) continue;
    return fail(ErrorKind::no_result, fmt::format("pass {}", view.pass),
                fmt::format("{} of its views can be used, {} are needed{}{}", count, least_views,
                            dropped.empty() ? "" : "; dropped:", dropped),
                "take more views");
  }
  return {};
}

/// Masks of all views in use; drops views that show another specimen.
Result<std::vector<Image8>> masks_of_views(const Session& session,
                                           const std::vector<Image8>& photographs,
                                           const std::vector<Image8>& given_masks,
                                           const std::vector<PoseObservation>& observations,
                                           int threads, PoseResult& poses,
                                           const Progress& progress) {
  std::vector<Image8> masks = given_masks;
  masks.resize(session.views.size());
  for (const auto& [pass, used] : used_by_pass(session, poses)) {
    if (std::ranges::none_of(used, [&](std::size_t i) { return masks[i].empty(); })) continue;
    std::vector<MaskView> views;
    for (const std::size_t i : used) {
      const ViewPose& pose = poses.views[i];
      const Lens& lens = poses.lenses[camera_index(session, session.views[i])].lens;
      views.push_back({&photographs[i], lens, pose.camera_from_table,
                       camera_from_board(session, poses, observations[i], pose, lens)});
    }
    MaskOptions options;
    options.threads = threads;
    auto found = find_masks(views, session.board ? &*session.board : nullptr, options, progress);
    if (!found) return forward(found);
    for (std::size_t k = 0; k < used.size(); ++k) {
      poses.views[used[k]].dropped = (*found)[k].odd;
      if (masks[used[k]].empty()) masks[used[k]] = std::move((*found)[k].mask);
    }
  }
  return masks;
}

Result<std::vector<StereoView>> stereo_views(const Session& session,
                                             const std::vector<Image8>& photographs,
                                             const std::vector<Image8>& masks,
                                             const PoseResult& poses,
                                             const std::vector<std::size_t>& used, int threads) {
  std::vector<StereoView> views(used.size());
  std::vector<std::optional<Error>> errors(used.size());
  parallel_for(static_cast<int>(used.size()), threads, [&](int k) {
    const auto at = static_cast<std::size_t>(k);
    const std::size_t i = used[at];
    const SessionView& view = session.views[i];
    auto made = make_stereo_view(view.image, photographs[i], masks[i],
                                 poses.lenses[camera_index(session, view)].lens,
                                 poses.views[i].camera_from_table, view.pass);
    if (made) {
      views[at] = *std::move(made);
    } else {
      errors[at] = made.error();
    }
  });
  for (const auto& error : errors) {
    if (error) return tl::unexpected<Error>(*error);
  }
  return views;
}

/// One pass on its way to the surface.
struct Pass {
  std::vector<StereoView> views;
  std::vector<DepthMap> maps;
};

Result<void> find_depths_of_passes(std::vector<Pass>& passes, const SurfaceOptions& options,
                                   const Progress& progress) {
  const auto count = static_cast<double>(passes.size());
  for (std::size_t p = 0; p < passes.size(); ++p) {
    const auto at = static_cast<double>(p);
    auto maps =
        find_depths(passes[p].views, options, progress.part(at / count, (at + 1.0) / count));
    if (!maps) return forward(maps);
    passes[p].maps = *std::move(maps);
  }
  return {};
}

/// What the passes are joined by: a surface without colours.
Result<TriangleMesh> bare_surface(const Pass& pass, const SurfaceOptions& options,
                                  const Progress& progress) {
  FusionOptions fusion = options.fusion;
  fusion.threads = options.threads;
  const auto volume = fuse_depth_maps(pass.maps, pass.views, fusion, progress);
  if (!volume) return forward(volume);
  return without_small_pieces(extract_surface(*volume, fusion.least_weight, options.threads),
                              options.cleaning)
      .mesh;
}

/// Moves all later passes to where the specimen lay in the first.
Result<std::vector<JoinedPass>> join_all(std::vector<Pass>& passes, const SurfaceOptions& options,
                                         std::uint64_t seed, const Progress& progress) {
  std::vector<JoinedPass> joined;
  if (passes.size() < 2) return joined;
  const auto first = bare_surface(passes[0], options, progress.part(0.0, 0.2));
  if (!first) return forward(first);
  const auto count = static_cast<double>(passes.size() - 1);
  for (std::size_t p = 1; p < passes.size(); ++p) {
    const Progress part =
        progress.part(0.2 + 0.8 * static_cast<double>(p - 1) / count, 0.2 + 0.8 * p / count);
    const auto second = bare_surface(passes[p], options, part.part(0.0, 0.2));
    if (!second) return forward(second);
    PassJoinOptions how;
    how.seed = seed;
    how.threads = options.threads;
    const auto join = join_passes(*first, *second, how, part.part(0.2, 1.0));
    if (!join) return forward(join);
    joined.push_back({passes[p].views.front().pass, *join});
    const Rigid3 second_from_first = join->first_from_second.inverse();
    for (StereoView& view : passes[p].views) {
      view.camera_from_table = view.camera_from_table * second_from_first;
    }
    for (DepthMap& map : passes[p].maps) {
      map.camera_from_table = map.camera_from_table * second_from_first;
    }
  }
  return joined;
}

/// All passes as one; the maps' sources keep naming the same views.
Pass merged(std::vector<Pass> passes) {
  Pass all = std::move(passes.front());
  for (std::size_t p = 1; p < passes.size(); ++p) {
    const int before = static_cast<int>(all.views.size());
    for (DepthMap& map : passes[p].maps) {
      for (int& source : map.sources) source += before;
      all.maps.push_back(std::move(map));
    }
    std::ranges::move(passes[p].views, std::back_inserter(all.views));
  }
  return all;
}

Session session_with_poses(Session session, const PoseResult& poses,
                           const std::vector<JoinedPass>& joined) {
  for (std::size_t c = 0; c < session.cameras.size(); ++c) {
    SessionCamera& camera = session.cameras[c];
    const Lens& lens = poses.lenses[c].lens;
    if (lens.fx > 0.0) camera.params = lens.params(camera.model);
  }
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    SessionView& view = session.views[i];
    view.camera_from_table.reset();
    if (!poses.views[i].used()) continue;
    Rigid3 pose = poses.views[i].camera_from_table;
    for (const JoinedPass& pass : joined) {
      if (pass.pass == view.pass) pose = pose * pass.join.first_from_second.inverse();
    }
    view.camera_from_table = pose;
  }
  return session;
}

}  // namespace

Result<std::vector<Image8>> read_given_masks(const Session& session,
                                             const std::filesystem::path& folder) {
  std::vector<Image8> masks(session.views.size());
  for (std::size_t i = 0; i < session.views.size(); ++i) {
    if (!session.views[i].mask) continue;
    const std::filesystem::path file = folder / *session.views[i].mask;
    auto mask = read_image(file);
    if (!mask) return forward(mask);
    const SessionCamera& camera = session.cameras[camera_index(session, session.views[i])];
    if (mask->width != camera.width || mask->height != camera.height) {
      return fail(ErrorKind::bad_input, file.string(),
                  fmt::format("is {} x {} px; its photograph is {} x {} px", mask->width,
                              mask->height, camera.width, camera.height));
    }
    masks[i] = grey_of(*mask);
  }
  return masks;
}

Result<SessionReconstruction> reconstruct_session(const Session& session,
                                                  const std::vector<Image8>& photographs,
                                                  const std::vector<Image8>& given_masks,
                                                  const ReconstructionOptions& options,
                                                  const Progress& progress) {
  SessionReconstruction result;
  progress.report(0.0, "looking for the board");
  const auto observations = pose_observations(session, photographs, options.threads);
  PoseOptions how = options.poses;
  how.threads = options.threads;
  how.motion.seed = options.seed;
  auto poses = find_poses(session, photographs, observations, how, progress.part(0.06, 0.1));
  if (!poses) return forward(poses);
  result.poses = *std::move(poses);
  if (const auto enough = check_enough(session, result.poses); !enough) return forward(enough);
  auto masks = masks_of_views(session, photographs, given_masks, observations, options.threads,
                              result.poses, progress.part(0.1, 0.15));
  if (!masks) return forward(masks);
  if (const auto enough = check_enough(session, result.poses); !enough) return forward(enough);

  std::vector<Pass> passes;
  for (const auto& [pass, used] : used_by_pass(session, result.poses)) {
    auto views = stereo_views(session, photographs, *masks, result.poses, used, options.threads);
    if (!views) return forward(views);
    passes.push_back({*std::move(views), {}});
  }
  masks->clear();
  SurfaceOptions surface = SurfaceOptions::of(options.quality, passes.front().views);
  surface.depth.seed = options.seed;
  surface.closed_rim_mm = options.closed_rim_mm;
  surface.threads = options.threads;
  if (const auto found = find_depths_of_passes(passes, surface, progress.part(0.18, 0.8)); !found) {
    return forward(found);
  }
  auto joined = join_all(passes, surface, options.seed, progress.part(0.8, 0.9));
  if (!joined) return forward(joined);
  result.joined = *std::move(joined);
  Pass all = merged(std::move(passes));
  auto made = surface_of_depths(std::move(all.maps), all.views, surface, progress.part(0.9, 1.0));
  if (!made) return forward(made);
  result.surface = *std::move(made);
  result.cameras = session_with_poses(session, result.poses, result.joined);
  return result;
}

}  // namespace skullstation
