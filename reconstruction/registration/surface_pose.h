#pragma once

#include <cstdint>

#include "core/result.h"
#include "core/transform.h"
#include "core/triangle_mesh.h"

namespace skullstation {

struct SurfacePoseOptions {
  bool unit_unknown = false;
  std::uint64_t seed = 1;
  int threads = 0;  ///< 0: all
};

/// Where a template lies on an input that shows all or a part of it: input_from_template, a
/// similarity. From any pose: register_globally, then ICP by place and direction with the size
/// free. The same for any number of threads.
Result<Similarity3> find_surface_pose(const TriangleMesh& surface, const TriangleMesh& input,
                                      const SurfacePoseOptions& options);

}  // namespace skullstation
