#pragma once

#include "reconstruction/volume/ct_surfaces.h"

namespace skullstation {

/// Looks where the head runs into the volume's borders, how thick the slices are, and at what the
/// figures in `quality` mean; adds the warnings to it.
void add_findings(const Volume& volume, const VoxelMask& head, bool mandible_found,
                  bool canal_found, CtQuality& quality);

}  // namespace skullstation
