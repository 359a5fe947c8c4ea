#include "reconstruction/phantom/tissue_map.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "core/parallel.h"
#include "reconstruction/phantom/canonical_skin.h"
#include "reconstruction/phantom/sculpture.h"
#include "reconstruction/phantom/skin_tube.h"
#include "reconstruction/phantom/skull_strokes.h"
#include "reconstruction/phantom/stroke.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

constexpr double kLattice_mm = 2.5;
constexpr double kDermis_mm = 2.0;
/// Soft tissue that keeps the airway shut.
constexpr double kSeal_mm = 3.0;

const Vector3d kEye_mm(31.5, -66.3, 20.0);
constexpr double kEyeRadius_mm = 12.0;
constexpr double kOrbitalFat_mm = 20.0;
const Vector3d kBuccalFat_mm(42.0, -62.0, -30.0);
constexpr double kBuccalFatRadius_mm = 14.0;

// From the nostrils to the nasal cavity; from its back down to the windpipe; the ear canal.
constexpr TubePoint kVestibule[] = {
    {{6, -103, -12}, 3.5}, {{4, -96, -8}, 4.0}, {{3, -86, -8}, 5.0}};
constexpr TubePoint kPharynx[] = {{{0, -42, -14}, 8.0},
                                  {{0, -22, -22}, 8.0},
                                  {{0, -16, -40}, 7.0},
                                  {{0, -17, -75}, 7.0},
                                  {{0, -22, -112}, 8.0}};
constexpr TubePoint kEarCanal[] = {{{62, -1, 0}, 3.0}, {{48, 0, 0}, 3.0}};

/// What the skull's table carves out in the given parts, as a solid of its own.
Sculpture carved_parts(std::initializer_list<std::string_view> parts) {
  std::vector<Stroke> strokes;
  for (const StrokeRow& row : cranium_strokes()) {
    if (row.tool != Stroke::Tool::carve || std::ranges::count(parts, row.part) == 0) continue;
    Stroke stroke;
    stroke.form = row.form;
    stroke.paired = row.paired;
    stroke.center_mm = Vector3d(row.center_mm);
    stroke.half_size_mm = Vector3d(row.half_size_mm);
    stroke.rotation_deg = Vector3d(row.rotation_deg);
    stroke.rounding_mm = row.rounding_mm;
    stroke.blend_mm = std::min(row.blend_mm, 8.0);
    strokes.push_back(stroke);
  }
  return Sculpture(strokes);
}

Vector3d on_the_left(const Vector3d& point) { return {std::abs(point.x()), point.y(), point.z()}; }

}  // namespace

const char* to_string(TissueKind kind) {
  switch (kind) {
    case TissueKind::air: return "air";
    case TissueKind::skin: return "skin";
    case TissueKind::fat: return "fat";
    case TissueKind::muscle: return "muscle";
    case TissueKind::brain: return "brain";
    case TissueKind::eye: return "eye";
  }
  return "unknown";
}

ScalarLattice::ScalarLattice(const Eigen::AlignedBox3d& box, double spacing_mm,
                             const std::function<double(const Vector3d&)>& value, int threads)
    : first_(box.min()), inverse_spacing_(1.0 / spacing_mm) {
  count_ = (box.sizes() * inverse_spacing_).array().ceil().cast<int>() + 2;
  values_.resize(static_cast<std::size_t>(count_.prod()));
  parallel_for(count_.z(), threads, [&](int k) {
    std::size_t at = static_cast<std::size_t>(k) * count_.x() * count_.y();
    for (int j = 0; j < count_.y(); ++j) {
      for (int i = 0; i < count_.x(); ++i) {
        values_[at++] = static_cast<float>(value(first_ + spacing_mm * Vector3d(i, j, k)));
      }
    }
  });
}

double ScalarLattice::at(const Vector3d& point) const {
  const Eigen::Array3d last = count_.cast<double>().array() - 1.001;
  const Eigen::Array3d place = ((point - first_) * inverse_spacing_).array().max(0.0).min(last);
  const Eigen::Array3i cell = place.cast<int>();
  const Eigen::Array3d part = place - cell.cast<double>();
  const std::size_t row = static_cast<std::size_t>(count_.x());
  const std::size_t slice = row * static_cast<std::size_t>(count_.y());
  const float* corner = values_.data() + static_cast<std::size_t>(cell.z()) * slice +
                        static_cast<std::size_t>(cell.y()) * row +
                        static_cast<std::size_t>(cell.x());
  const auto along_x = [&](const float* p) { return p[0] + part.x() * (p[1] - p[0]); };
  const auto along_y = [&](const float* p) {
    const double near = along_x(p);
    return near + part.y() * (along_x(p + row) - near);
  };
  const double near = along_y(corner);
  return near + part.z() * (along_y(corner + slice) - near);
}

TissueMap::TissueMap(int threads)
    : skin_(
          skin_solid()->bounds(), kLattice_mm,
          [skin = std::shared_ptr<ImplicitSolid>(skin_solid())](const Vector3d& p) {
            return skin->distance_mm(p);
          },
          threads),
      brain_(
          skin_solid()->bounds(), kLattice_mm,
          [cavity = carved_parts({"cavity"})](const Vector3d& p) { return cavity.distance_mm(p); },
          threads),
      airway_(
          skin_solid()->bounds(), kLattice_mm,
          [cavity = carved_parts({"nasal cavity", "maxillary sinus", "frontal sinus"}),
           vestibule = Tube(kVestibule), pharynx = Tube(kPharynx),
           canal = Tube(kEarCanal)](const Vector3d& p) {
            const Vector3d left = on_the_left(p);
            return std::min({cavity.distance_mm(p), vestibule.distance_mm(left),
                             pharynx.distance_mm(left), canal.distance_mm(left)});
          },
          threads) {}

TissueKind TissueMap::at(const Vector3d& point) const {
  const double depth_mm = -skin_.at(point);
  if (depth_mm < kDermis_mm) return TissueKind::skin;
  // Up to the bone: what the bone's surface leaves over belongs to the cavity behind it.
  if (depth_mm > kSeal_mm && airway_.at(point) < 0.5) return TissueKind::air;
  if (brain_.at(point) < 1.0) return TissueKind::brain;
  const Vector3d left = on_the_left(point);
  const double from_eye_mm = (left - kEye_mm).norm();
  if (from_eye_mm < kEyeRadius_mm) return TissueKind::eye;
  if (from_eye_mm < kOrbitalFat_mm && left.y() > kEye_mm.y()) return TissueKind::fat;
  if ((left - kBuccalFat_mm).norm() < kBuccalFatRadius_mm) return TissueKind::fat;
  const double fat_mm = left.z() > 35.0 ? 1.5 : 3.5;
  return depth_mm < kDermis_mm + fat_mm ? TissueKind::fat : TissueKind::muscle;
}

}  // namespace skullstation
