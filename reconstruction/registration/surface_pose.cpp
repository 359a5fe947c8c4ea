#include "reconstruction/registration/surface_pose.h"

#include "reconstruction/registration/global_registration.h"
#include "reconstruction/registration/oriented_points.h"
#include "reconstruction/registration/point_icp.h"
#include "reconstruction/registration/point_tree.h"

namespace skullstation {

namespace {
constexpr int kSourcePoints = 3000;
constexpr int kTargetPoints = 12000;
}  // namespace

Result<Similarity3> find_surface_pose(const TriangleMesh& surface, const TriangleMesh& input,
                                      const SurfacePoseOptions& options) {
  GlobalRegistrationOptions global;
  global.scale = options.unit_unknown ? ScaleKnowledge::unknown : ScaleKnowledge::same_unit;
  global.seed = options.seed;
  global.threads = options.threads;
  // People differ by more than the tolerance of a pose; what follows refuses what does not fit.
  global.least_overlap = 0.22;
  const auto found = register_globally(input, surface, global);
  if (!found) return forward(found);

  // The input may be a part: its points look for partners on the template.
  const auto source = oriented_samples_of_count(input, kSourcePoints);
  if (!source) return forward(source);
  const auto target = oriented_samples_of_count(surface, kTargetPoints);
  if (!target) return forward(target);
  const PointTree tree(target->positions);
  Similarity3 template_from_input = found->target_from_source;
  for (const double reach_mm : {15.0, 8.0}) {
    PointIcpOptions icp;
    icp.estimate_scale = true;
    icp.max_distance_mm = reach_mm;
    icp.tolerance_mm = 1e-3;
    icp.threads = options.threads;
    const auto fit = align_points(*source, *target, tree, template_from_input, icp);
    if (!fit) break;  // the global pose stands
    template_from_input = fit->target_from_source;
  }
  return template_from_input.inverse();
}

}  // namespace skullstation
