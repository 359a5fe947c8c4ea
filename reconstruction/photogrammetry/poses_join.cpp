#include "reconstruction/photogrammetry/poses_join.h"

#include <fmt/format.h>

#include "reconstruction/registration/global_registration.h"
#include "reconstruction/registration/point_icp.h"

namespace skullstation {

Result<PassJoin> join_passes(const TriangleMesh& first, const TriangleMesh& second,
                             const PassJoinOptions& options, const Progress& progress) {
  constexpr const char* subject = "joining the passes";
  const auto refuse = [&](std::string what) {
    return fail(ErrorKind::no_result, subject, std::move(what),
                "take more views of the specimen's sides in both passes, or a pass on its side");
  };
  GlobalRegistrationOptions global;
  global.least_overlap = options.least_overlap;
  global.seed = options.seed;
  global.threads = options.threads;
  const auto found = register_globally(second, first, global, progress.part(0.0, 0.8));
  if (!found) {
    if (found.error().kind != ErrorKind::no_result) return forward(found);
    return refuse("the two surfaces don't fit together: " + found.error().what);
  }
  constexpr double spacing_mm = 1.5;
  const auto source = oriented_samples(second, spacing_mm);
  if (!source) return forward(source);
  const auto target = oriented_samples(first, 0.5 * spacing_mm);
  if (!target) return forward(target);
  const PointTree tree(target->positions);
  Similarity3 place = found->target_from_source;
  PassJoin join;
  for (const double reach_mm : {2.0, 0.8}) {
    PointIcpOptions icp;
    icp.max_distance_mm = reach_mm;
    icp.max_iterations = 60;
    icp.threads = options.threads;
    const auto fit = align_points(*source, *target, tree, place, icp);
    if (!fit) return refuse("the two surfaces don't fit together: " + fit.error().what);
    place = fit->target_from_source;
    join.overlap = fit->overlap;
    join.rms_mm = fit->rms_mm;
  }
  join.first_from_second = {place.rotation, place.translation};
  join.runner_up = found->runner_up;
  if (join.overlap < options.least_overlap) {
    return refuse(fmt::format("only {:.0f} % of one surface lies on the other; {:.0f} % are needed",
                              100.0 * join.overlap, 100.0 * options.least_overlap));
  }
  if (join.rms_mm > options.worst_rms_mm) {
    return refuse(
        fmt::format("the surfaces lie {:.2f} mm apart where they meet; {:.2f} mm are "
                    "allowed",
                    join.rms_mm, options.worst_rms_mm));
  }
  if (join.runner_up > 0.0 && join.runner_up < options.least_runner_up) {
    return refuse("the surfaces fit together in two ways nearly as well");
  }
  progress.report(1.0, subject);
  return join;
}

}  // namespace skullstation
