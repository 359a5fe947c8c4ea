#include "capture/simulation/bone_texture.h"

#include <algorithm>
#include <cmath>

#include "capture/simulation/solid_noise.h"
#include "core/random.h"

namespace skullstation {

namespace {

using Eigen::Vector3f;

/// Speckle: relative amplitude of each band, chosen so that every scale has some contrast of its
/// own, as photographs of dry bone have.
struct Band {
  float wavelength_mm;
  float amplitude;
};
constexpr Band speckle_bands[] = {
    {8.0F, 0.10F}, {3.5F, 0.10F}, {1.6F, 0.12F}, {0.8F, 0.14F}, {0.4F, 0.16F}, {0.2F, 0.16F},
};

/// How far a line that is `half_width` wide on either side covers a footprint at `distance`.
float line_cover(float distance, float half_width, float footprint) {
  const float soft = std::max(footprint, 0.5F * half_width);
  const float cover = std::clamp((half_width + 0.5F * soft - distance) / soft, 0.0F, 1.0F);
  return cover * std::min(1.0F, 2.0F * half_width / soft);
}

float smooth_step(float low, float high, float x) {
  const float t = std::clamp((x - low) / (high - low), 0.0F, 1.0F);
  return t * t * (3.0F - 2.0F * t);
}

}  // namespace

BoneTexture::BoneTexture(const BoneLook& look, const Eigen::AlignedBox3d& specimen_box)
    : look_(look), seed_(static_cast<std::uint32_t>(mix(look.seed, 0))) {
  const bool known = !specimen_box.isEmpty();
  centre_ = known ? Vector3f(specimen_box.center().cast<float>()) : Vector3f::Zero();
  half_size_ = known ? Vector3f(0.5F * specimen_box.sizes().cast<float>()) : Vector3f::Ones();
}

float BoneTexture::suture_depth(const Vector3f& x, float footprint_mm) const {
  // On the vault only: above the middle of the specimen.
  const Vector3f r = (x - centre_).cwiseQuotient(half_size_);
  const float vault = smooth_step(0.15F, 0.35F, r.z());
  if (vault <= 0.0F) return 0.0F;

  // Where the lines run: a plane across (coronal), one along (sagittal, between the other two)
  // and a chevron behind (lambdoid). Signed distances in mm.
  const float coronal =
      x.y() - (centre_.y() - 0.22F * half_size_.y()) + 0.10F * (x.z() - centre_.z());
  const float lambdoid =
      x.y() - (centre_.y() + 0.66F * half_size_.y()) + 0.45F * std::abs(x.x() - centre_.x());
  const float sagittal = x.x() - centre_.x();
  const float nearest = std::min({std::abs(coronal), std::abs(lambdoid), std::abs(sagittal)});
  constexpr float reach_mm = 5.0F;
  if (nearest > reach_mm) return 0.0F;

  // The zigzag: interlocking teeth some millimetres long.
  const float wander = 3.0F * gradient_noise(x / 9.0F, seed_ + 101) +
                       3.2F * gradient_noise(x / 2.6F, seed_ + 102) +
                       0.8F * gradient_noise(x / 1.0F, seed_ + 103);
  const float half_width = 0.16F + 0.10F * gradient_noise(x / 6.0F, seed_ + 104);
  float cover = line_cover(std::abs(coronal + wander), half_width, footprint_mm);
  cover = std::max(cover, line_cover(std::abs(lambdoid + wander), half_width, footprint_mm));
  if (coronal > 0.0F && lambdoid < 0.0F) {
    cover = std::max(cover, line_cover(std::abs(sagittal + wander), half_width, footprint_mm));
  }
  // Old sutures are partly closed.
  const float open = smooth_step(-0.45F, 0.15F, gradient_noise(x / 22.0F, seed_ + 105));
  return vault * open * cover;
}

float BoneTexture::pore_depth(const Vector3f& x, float footprint_mm) const {
  // One pore at most in a cell, wholly inside it, so that a point looks at its own cell only.
  constexpr float cell_mm = 1.3F;
  const Vector3f scaled = x / cell_mm;
  const Eigen::Vector3i cell(cell_of(scaled.x()), cell_of(scaled.y()), cell_of(scaled.z()));
  const std::uint32_t h = cell_hash(cell.x(), cell.y(), cell.z(), seed_ + 201);
  const std::uint32_t where = cell_hash(static_cast<int>(h & 0xffffU), 0, 0, seed_ + 202);
  const auto unit = [](std::uint32_t bits) { return static_cast<float>(bits & 0x3ffU) / 1023.0F; };
  const float radius_mm = 0.08F + 0.17F * unit(h >> 2) * unit(h >> 12);
  const float margin = radius_mm / cell_mm;
  const Vector3f centre =
      Vector3f::Constant(margin) +
      (1.0F - 2.0F * margin) * Vector3f(unit(where), unit(where >> 10), unit(where >> 20));
  const float distance = cell_mm * (scaled - cell.cast<float>() - centre).norm();
  return unit(h >> 22) * line_cover(distance, radius_mm, footprint_mm);
}

Vector3f BoneTexture::albedo(const Eigen::Vector3d& x_specimen, float footprint_mm) const {
  const Vector3f x = x_specimen.cast<float>();
  float speckle = 0.0F;
  std::uint32_t band_seed = seed_ + 1;
  for (const Band& band : speckle_bands) {
    const float share = visible_share(band.wavelength_mm, footprint_mm);
    // The noise's own wavelength is 1.5.
    if (share > 0.0F) {
      speckle +=
          share * band.amplitude * gradient_noise(x * (1.5F / band.wavelength_mm), band_seed);
    }
    ++band_seed;
  }
  const float stain =
      0.6F * gradient_noise(x / 38.0F, seed_ + 301) + 0.4F * gradient_noise(x / 15.0F, seed_ + 302);
  const auto strength = [](double factor) { return static_cast<float>(factor); };
  const float stained = strength(look_.stains) * smooth_step(-0.05F, 0.35F, stain);
  const float light = (1.0F + 1.4F * strength(look_.speckle) * speckle) *
                      (1.0F - 0.45F * strength(look_.pores) * pore_depth(x, footprint_mm)) *
                      (1.0F - 0.55F * strength(look_.sutures) * suture_depth(x, footprint_mm));

  const Vector3f ivory(0.69F, 0.60F, 0.455F);
  const Vector3f brown(0.50F, 0.385F, 0.25F);
  const Vector3f colour = ivory + 0.55F * stained * (brown - ivory);
  return (colour * std::clamp(light, 0.05F, 1.4F)).cwiseMin(1.0F).cwiseMax(0.0F);
}

}  // namespace skullstation
