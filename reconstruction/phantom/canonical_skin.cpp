#include "reconstruction/phantom/canonical_skin.h"

#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/isosurface.h"
#include "reconstruction/phantom/skin_shape.h"
#include "reconstruction/phantom/skin_tables.h"

namespace skullstation {

namespace {

/// Where the neck is cut off: below the chin and the hyoid bone.
constexpr double kNeckZ_mm = -118.0;

}  // namespace

std::unique_ptr<ImplicitSolid> skin_solid() {
  return std::make_unique<SkinShape>(skin_rough_forms(), skin_dabs(), skin_features(), kNeckZ_mm);
}

TriangleMesh canonical_skin(double edge_mm, int threads) {
  return largest_component(isosurface(*skin_solid(), {.cell_mm = edge_mm, .threads = threads}));
}

}  // namespace skullstation
