#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace skullstation {

/// Gradient noise (Perlin 2002): a smooth function of space that varies at a wavelength of about
/// 1.5, with mean 0 and values in [-1, 1]; standard deviation about 0.25.
float gradient_noise(const Eigen::Vector3f& x, std::uint32_t seed);

/// The lattice cell that x lies in: the largest integer not above it. \pre it fits an int
int cell_of(float x);

/// A hash of a lattice cell.
std::uint32_t cell_hash(int x, int y, int z, std::uint32_t seed);

/// 1 for waves much longer than the footprint, 0 below its Nyquist limit: the share of a band of
/// noise that a sensor element of width `footprint` can see.
float visible_share(float wavelength, float footprint);

}  // namespace skullstation
