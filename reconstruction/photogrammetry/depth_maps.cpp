#include "reconstruction/photogrammetry/depth_maps.h"

#include <algorithm>
#include <utility>

#include "core/parallel.h"
#include "core/random.h"
#include "reconstruction/photogrammetry/depth_agreement.h"
#include "reconstruction/photogrammetry/source_views.h"

namespace skullstation {

namespace {

/// The sweeps of one round; all views finish a round before any begins the next.
struct Round {
  int level = 0;
  bool geometric = false;
  std::vector<SweepOptions> sweeps;
};

/// What each level needs: the coarsest searches, the finer ones follow it up.
std::vector<Round> plan_rounds(const DepthMapOptions& options) {
  std::vector<Round> rounds;
  for (int level = options.coarsest_level; level >= options.finest_level; --level) {
    if (level == options.coarsest_level) {
      Round search{level, false, {}};
      for (int i = 0; i < 6; ++i) {
        SweepOptions sweep;
        sweep.random_trials = i < 4 ? 2 : 0;
        sweep.depth_step_px = i < 3 ? 4.0 : 1.0;
        sweep.slope_step = i < 3 ? 0.8 : 0.4;
        sweep.refinements = 3;
        search.sweeps.push_back(sweep);
      }
      rounds.push_back(search);
    }
    const bool last = level == options.finest_level;
    const int count = last ? options.finest_rounds : 2;
    for (int i = 0; i < count; ++i) {
      Round round{level, true, {}};
      SweepOptions sweep;
      sweep.geometric_weight = 0.15;
      sweep.depth_step_px = i == 0 ? 1.0 : 0.4;
      sweep.slope_step = i == 0 ? 0.4 : 0.2;
      sweep.refinements = level == 0 ? 2 : 3;
      // What is too thin for the coarsest level is found on the next.
      sweep.random_trials = level == options.coarsest_level - 1 && i == 0 ? 2 : 0;
      sweep.score_all_sources = level > 0;
      if (last && count == 1) sweep.parabola_px = 0.35;
      round.sweeps.push_back(sweep);
      if (last && i == 1) {
        sweep.parabola_px = 0.35;
        sweep.depth_step_px = 0.2;
        sweep.slope_step = 0.1;
        round.sweeps.push_back(sweep);
      }
      rounds.push_back(round);
    }
  }
  return rounds;
}

/// About the window's radius: what is smoother than the window only misleads it.
constexpr double kShadingSd_px = 4.0;

/// All levels of a view but those finer than asked for.
std::vector<StereoLevel> pyramid_of(const StereoView& view, int finest, int coarsest) {
  std::vector<StereoLevel> levels(coarsest + 1);
  Image8 grey = grey_of(view.color);
  Image8 mask = view.mask;
  for (int level = 0; level <= coarsest; ++level) {
    if (level > 0) {
      grey = halved(grey);
      mask = halved(mask);
    }
    if (level < finest) continue;
    const Image8 texture = without_shading(grey, mask, kShadingSd_px);
    levels[level] = {view.camera.reduced(level), view.camera_from_table, texture, mask,
                     packed_quads(texture)};
  }
  return levels;
}

}  // namespace

Result<void> DepthMapOptions::validate() const {
  const auto refuse = [](const char* what) {
    return fail(ErrorKind::usage, "depth map options", what);
  };
  if (source_views < 2 || source_views > kMostSources) return refuse("source_views is 2 to 8");
  if (finest_level < 0 || coarsest_level < finest_level || coarsest_level > 5) {
    return refuse("levels go from 0 (the photographs' size) to 5, the finest first");
  }
  if (finest_rounds < 1 || finest_rounds > 2) return refuse("finest_rounds is 1 or 2");
  if (hull_resolution < 16 || hull_resolution > 512) return refuse("hull_resolution is 16 to 512");
  if (!(agreement_px > 0.0) || !(agreement_depth_px > 0.0) || least_agreement < 0 ||
      least_agreement > source_views || !(worst_cost > 0.0)) {
    return refuse("the limits of agreement must be positive, least_agreement at most source_views");
  }
  return {};
}

Result<std::vector<DepthMap>> match_depth_maps(std::span<const StereoView> views,
                                               const VisualHull& hull,
                                               const DepthMapOptions& options,
                                               const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  const auto count = static_cast<int>(views.size());
  const std::vector<std::vector<int>> sources =
      choose_source_views(views, hull.centre_mm(), {.count = options.source_views});
  for (int v = 0; v < count; ++v) {
    if (sources[v].size() >= 2) continue;
    return fail(ErrorKind::bad_input, views[v].name,
                "has fewer than two other views within 4 to 45 degrees",
                "take more views, about every 15 degrees");
  }

  std::vector<std::vector<StereoLevel>> levels(count);
  std::vector<HullRange> ranges(count);
  parallel_for(count, options.threads, [&](int v) {
    levels[v] = pyramid_of(views[v], options.finest_level, options.coarsest_level);
    ranges[v] = hull_range(hull, views[v].camera.reduced(options.coarsest_level),
                           views[v].camera_from_table);
  });
  const auto problem_of = [&](int v, int level) {
    MatchProblem problem;
    problem.reference = &levels[v][level];
    for (const int source : sources[v]) problem.sources.push_back(&levels[source][level]);
    problem.range = &ranges[v];
    problem.range_level = options.coarsest_level - level;
    problem.seed =
        mix(mix(options.seed, static_cast<std::uint64_t>(v)), static_cast<std::uint64_t>(level));
    return problem;
  };

  std::vector<PlaneMap> maps(count);
  std::vector<PlaneMap> next(count);
  const std::vector<Round> rounds = plan_rounds(options);
  // Work grows fourfold from level to level.
  double work = 0.0, done = 0.0;
  const auto work_of = [](const Round& round) {
    return static_cast<double>(round.sweeps.size()) / static_cast<double>(1 << (2 * round.level));
  };
  for (const Round& round : rounds) work += work_of(round);
  int level = options.coarsest_level;
  int pass = 0;
  for (const Round& round : rounds) {
    progress.report(done / work, "depth maps");
    if (progress.stop.stop_requested()) {
      return fail(ErrorKind::cancelled, "depth maps", "cancelled");
    }
    const bool finer = round.level != level;
    parallel_for(count, options.threads, [&](int v) {
      const MatchProblem problem = problem_of(v, round.level);
      if (!round.geometric) {
        next[v] = random_planes(problem, PatchOptions{});
      } else if (finer) {
        next[v] = upsampled(maps[v], problem);
      }
    });
    if (!round.geometric || finer) std::swap(maps, next);
    level = round.level;
    if (round.geometric) next = maps;
    std::vector<PlaneMap>& improved = round.geometric ? next : maps;
    parallel_for(count, options.threads, [&](int v) {
      const MatchProblem problem = problem_of(v, round.level);
      std::vector<const PlaneMap*> source_maps;
      if (round.geometric) {
        for (const int source : sources[v]) source_maps.push_back(&maps[source]);
      }
      for (std::size_t s = 0; s < round.sweeps.size(); ++s) {
        sweep(problem, round.sweeps[s], pass + static_cast<int>(s), source_maps, improved[v]);
      }
    });
    if (round.geometric) std::swap(maps, next);
    pass += static_cast<int>(round.sweeps.size());
    done += work_of(round);
  }
  next.clear();

  std::vector<DepthMap> depth(count);
  for (int v = 0; v < count; ++v) {
    depth[v] = {levels[v][options.finest_level].camera,
                views[v].camera_from_table,
                views[v].pass,
                std::move(maps[v].planes),
                {},
                std::move(maps[v].cost),
                sources[v]};
    maps[v] = {};
  }
  progress.report(1.0, "depth maps");
  return depth;
}

Result<std::vector<DepthMap>> compute_depth_maps(std::span<const StereoView> views,
                                                 const VisualHull& hull,
                                                 const DepthMapOptions& options,
                                                 const Progress& progress) {
  auto maps = match_depth_maps(views, hull, options, progress);
  if (maps) keep_confirmed(*maps, options);
  return maps;
}

}  // namespace skullstation
