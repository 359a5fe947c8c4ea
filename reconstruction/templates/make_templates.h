#pragma once

#include "core/progress.h"
#include "core/result.h"
#include "reconstruction/registration/head_template.h"
#include "reconstruction/registration/skull_template.h"

namespace skullstation {

struct SkullTemplateOptions {
  double face_edge_mm = 1.7;  ///< edges of the surface in the face; the vault's are 1.6 as long
  int threads = 0;            ///< 0: all

  Result<void> validate() const;
};

/// The canonical skull as a solid of tetrahedra (Delaunay refinement: CGAL Mesh_3), with its
/// regions, outside, mirror map and landmarks. About 70,000 vertices with the default options.
Result<SkullTemplate> make_skull_template(const SkullTemplateOptions& options = {},
                                          const Progress& progress = {});

struct HeadTemplateOptions {
  double face_edge_mm = 3.5;  ///< shorter at nose, lips, lids and ears; longer on the scalp
  int threads = 0;

  Result<void> validate() const;
};

/// The canonical skin as one sheet, exactly symmetric, with regions, mirror map, weights and
/// landmarks. About 6,000 vertices with the default options.
Result<HeadTemplate> make_head_template(const HeadTemplateOptions& options = {},
                                        const Progress& progress = {});

}  // namespace skullstation
