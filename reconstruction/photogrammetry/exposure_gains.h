#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "core/image.h"
#include "core/triangle_mesh.h"
#include "reconstruction/photogrammetry/sights.h"

namespace skullstation {

/// Linear RGB in [0, 1] at an image point of an sRGB or grey image, bilinear; beyond the border its
/// last pixel.
Eigen::Vector3f linear_light_at(const Image8& image, const Eigen::Vector2d& point_px);

/// sRGB of linear light (IEC 61966-2-1); what is brighter than 1 is cut off.
std::array<std::uint8_t, 3> srgb_of(const Eigen::Vector3f& light);

/// Gain of each view's linear light that brings all to a common scale, their mean: least squares on
/// the medians of the logarithmic ratios between two views at vertices that both see (Brown & Lowe
/// 2007, gain compensation).
/// \pre the mesh has normals
std::vector<float> exposure_gains(const TriangleMesh& mesh, const Sights& sights);

}  // namespace skullstation
