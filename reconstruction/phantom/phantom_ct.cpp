#include "reconstruction/phantom/phantom_ct.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "core/parallel.h"
#include "reconstruction/phantom/phantom_ct_distance.h"
#include "reconstruction/phantom/phantom_ct_scanner.h"
#include "reconstruction/phantom/tissue_teeth.h"

namespace skullstation {

namespace {

using Eigen::Vector3d;

constexpr double kAir_hu = -1000.0;
constexpr double kCortical_hu = 1500.0;
constexpr double kTrabecular_hu = 450.0;
constexpr double kCorticalDepth_mm = 1.8;
constexpr double kTrabecularDepth_mm = 2.5;
constexpr double kBone_hu = 600.0;   ///< Gietzen et al. 2019: the bone's isosurface
constexpr double kSkin_hu = -200.0;  ///< and the skin's
/// Distances are exact to beyond the cortical bone.
constexpr double kBand_mm = 3.0;
/// The warp back to the canonical head is smooth: taken at every so many mm, linear in between.
constexpr double kWarp_mm = 4.0;

constexpr double kShellGap_mm = 6.0;  ///< padding between head and head rest
constexpr double kShell_mm = 4.0;
constexpr double kTableGap_mm = 35.0;
constexpr double kTable_mm = 8.0;
constexpr double kPadding_hu = -930.0;
constexpr double kShell_hu = -150.0;
constexpr double kTable_hu = -60.0;

double soft_hu(TissueKind kind) {
  switch (kind) {
    case TissueKind::air: return kAir_hu;
    case TissueKind::skin: return 40.0;
    case TissueKind::fat: return -100.0;
    case TissueKind::muscle: return 55.0;
    case TissueKind::brain: return 35.0;
    case TissueKind::eye: return 15.0;
  }
  return 0.0;
}

/// Share of the point spread function that lies inside a plane border `distance` away.
double inside_share(double distance_mm, double sd_mm) {
  return 0.5 * std::erfc(distance_mm / (sd_mm * std::numbers::sqrt2));
}

/// How far the border of two materials lies before the surface that the isosurface at `iso_hu` is
/// to meet: the x for which low + (high - low) * inside_share(-x) = iso.
double border_offset_mm(double low_hu, double high_hu, double iso_hu, double sd_mm) {
  const double share = std::clamp((iso_hu - low_hu) / (high_hu - low_hu), 0.02, 0.98);
  double below = -3.0;
  double above = 3.0;
  for (int halving = 0; halving < 40; ++halving) {
    const double middle = 0.5 * (below + above);
    (inside_share(-middle, 1.0) < share ? below : above) = middle;
  }
  return 0.5 * (below + above) * sd_mm;
}

VoxelGrid grid_around(const TriangleMesh& skin, const PhantomCtOptions& options) {
  Eigen::AlignedBox3d box;  // in the grid's axes
  for (Eigen::Index v = 0; v < skin.vertices.rows(); ++v) {
    box.extend(options.direction.transpose() * skin.vertices.row(v).transpose());
  }
  box.min().array() -= options.margin_mm;
  box.max().array() += options.margin_mm;
  // Crops are asked for in the patient's directions: they take from the nearest grid axis.
  const auto crop = [&](const Vector3d& towards, double mm) {
    if (mm <= 0.0) return;
    int axis = 0;
    const Vector3d local = options.direction.transpose() * towards;
    local.cwiseAbs().maxCoeff(&axis);
    if (local[axis] > 0.0) {
      box.max()[axis] -= options.margin_mm + mm;
    } else {
      box.min()[axis] += options.margin_mm + mm;
    }
  };
  crop(Vector3d::UnitZ(), options.cropped_calvaria_mm);
  crop(-Vector3d::UnitY(), options.cropped_nose_mm);
  VoxelGrid grid;
  grid.spacing_mm = options.spacing_mm;
  grid.direction = options.direction;
  grid.origin_mm = options.direction * box.min();
  grid.size = (box.sizes().cwiseQuotient(options.spacing_mm)).array().ceil().cast<int>() + 1;
  return grid;
}

/// The bed: foam and a curved shell behind the head, and a plate below it.
class Bed {
 public:
  Bed(const TriangleMesh& skin, const PhantomCtOptions& options)
      : head_rest_(options.head_rest), table_(options.table) {
    const Eigen::AlignedBox3d box = bounding_box(skin);
    const double half_width = 0.5 * box.sizes().x();
    radius_mm_ = half_width + 15.0;
    axis_x_ = box.center().x();
    axis_y_ = box.max().y() + kShellGap_mm - radius_mm_;
    table_y_ = box.max().y() + kTableGap_mm;
  }

  double hu(const Vector3d& patient) const {
    if (head_rest_ && patient.y() > axis_y_ + 0.3 * radius_mm_) {
      const double r = std::hypot(patient.x() - axis_x_, patient.y() - axis_y_);
      if (r > radius_mm_ && r < radius_mm_ + kShell_mm) return kShell_hu;
      if (r > radius_mm_ - kShellGap_mm && r <= radius_mm_) return kPadding_hu;
    }
    if (table_ && patient.y() > table_y_ && patient.y() < table_y_ + kTable_mm) return kTable_hu;
    return kAir_hu;
  }

 private:
  bool head_rest_;
  bool table_;
  double radius_mm_ = 0.0;
  double axis_x_ = 0.0;
  double axis_y_ = 0.0;
  double table_y_ = 0.0;
};

/// Patient to canonical head, sampled once and interpolated.
class CanonicalPlaces {
 public:
  CanonicalPlaces(const PhantomBody& body, int threads) {
    const Eigen::AlignedBox3d box = bounding_box(body.skin);
    first_ = box.min();
    count_ = (box.sizes() / kWarp_mm).array().ceil().cast<int>() + 2;
    places_.resize(static_cast<std::size_t>(count_.prod()));
    parallel_for(count_.z(), threads, [&](int k) {
      std::size_t at = static_cast<std::size_t>(k) * count_.x() * count_.y();
      for (int j = 0; j < count_.y(); ++j) {
        for (int i = 0; i < count_.x(); ++i) {
          const CanonicalPlace place =
              body.canonical_from_patient(first_ + kWarp_mm * Vector3d(i, j, k));
          places_[at++] << place.skull.cast<float>(), place.soft.cast<float>();
        }
      }
    });
  }

  CanonicalPlace at(const Vector3d& patient) const {
    const Eigen::Array3d last = count_.cast<double>().array() - 1.001;
    const Eigen::Array3d place = ((patient - first_) / kWarp_mm).array().max(0.0).min(last);
    const Eigen::Array3i cell = place.cast<int>();
    const Eigen::Array3f part = (place - cell.cast<double>()).cast<float>();
    const std::size_t row = static_cast<std::size_t>(count_.x());
    const std::size_t slice = row * static_cast<std::size_t>(count_.y());
    const Places* corner = places_.data() + static_cast<std::size_t>(cell.z()) * slice +
                           static_cast<std::size_t>(cell.y()) * row +
                           static_cast<std::size_t>(cell.x());
    const auto along_x = [&](const Places* p) -> Places { return p[0] + part.x() * (p[1] - p[0]); };
    const auto along_y = [&](const Places* p) -> Places {
      const Places near = along_x(p);
      return near + part.y() * (along_x(p + row) - near);
    };
    const Places near = along_y(corner);
    const Places both = near + part.z() * (along_y(corner + slice) - near);
    return {both.head<3>().cast<double>(), both.tail<3>().cast<double>()};
  }

 private:
  using Places = Eigen::Matrix<float, 6, 1>;  // of skull and soft tissue

  Vector3d first_;
  Eigen::Vector3i count_;
  std::vector<Places> places_;
};

double bone_hu(double depth_mm, const Vector3d& canonical, const Rigid3& closed_from_open) {
  if (const auto tooth = tooth_hu(canonical, closed_from_open, depth_mm)) return *tooth;
  const double share = std::clamp(
      (depth_mm - kCorticalDepth_mm) / (kTrabecularDepth_mm - kCorticalDepth_mm), 0.0, 1.0);
  return kCortical_hu + share * (kTrabecular_hu - kCortical_hu);
}

}  // namespace

Result<void> PhantomCtOptions::validate() const {
  const auto refuse = [](const std::string& what) {
    return fail(ErrorKind::usage, "CT phantom", what);
  };
  if (!(spacing_mm.minCoeff() >= 0.2) || !(spacing_mm.maxCoeff() <= 10.0)) {
    return refuse("the spacing must lie between 0.2 and 10 mm");
  }
  if (!((direction.transpose() * direction - Eigen::Matrix3d::Identity()).norm() < 1e-6)) {
    return refuse("the direction's columns must be unit vectors at right angles");
  }
  if (!(margin_mm >= 0.0 && margin_mm <= 200.0)) return refuse("the margin must be 0 to 200 mm");
  if (!(cropped_calvaria_mm >= 0.0 && cropped_calvaria_mm <= 100.0) ||
      !(cropped_nose_mm >= 0.0 && cropped_nose_mm <= 100.0)) {
    return refuse("0 to 100 mm may be cropped");
  }
  if (!(blur_fwhm_mm >= 0.0 && blur_fwhm_mm <= 5.0)) return refuse("the blur must be 0 to 5 mm");
  if (!(noise_sd_hu >= 0.0 && noise_sd_hu <= 200.0)) return refuse("the noise must be 0 to 200 HU");
  if (!(streak_hu >= 0.0 && streak_hu <= 3000.0)) return refuse("streaks must be 0 to 3000 HU");
  return {};
}

Result<Volume> phantom_ct(const PhantomBody& body, const TissueMap& tissue,
                          const PhantomCtOptions& options, const Progress& progress) {
  if (const auto valid = options.validate(); !valid) return forward(valid);
  if (body.skin.triangles.rows() == 0 || body.bone.triangles.rows() == 0) {
    return fail(ErrorKind::bad_input, "CT phantom", "bone or skin has no triangles");
  }
  const auto cancelled = [&] { return fail(ErrorKind::cancelled, "CT phantom", "cancelled"); };
  Volume volume;
  volume.grid = grid_around(body.skin, options);
  const VoxelGrid& grid = volume.grid;
  if (grid.size.minCoeff() < 2) {
    return fail(ErrorKind::usage, "CT phantom", "nothing is left of the head", "crop less");
  }

  progress.report(0.0, "distances");
  const auto bone = voxel_distances(body.bone, grid, kBand_mm, options.threads);
  if (!bone) return forward(bone);
  if (progress.stop.stop_requested()) return cancelled();
  progress.report(0.3, "distances");
  const auto skin = voxel_distances(body.skin, grid, kBand_mm, options.threads);
  if (!skin) return forward(skin);
  if (progress.stop.stop_requested()) return cancelled();
  progress.report(0.5, "tissue");

  // Edges are drawn as wide as a voxel blurs them; the scanner's blur comes on top.
  const double voxel_sd_mm = options.spacing_mm.mean() / std::sqrt(12.0);
  const double blur_sd_mm = options.blur_fwhm_mm / (2.0 * std::sqrt(2.0 * std::numbers::ln2));
  // Whoever takes an isosurface interpolates linearly: on average a triangular kernel more.
  const double reader_sd_mm = std::sqrt(options.spacing_mm.squaredNorm() / 3.0 / 6.0);
  const double sd_mm = std::hypot(voxel_sd_mm, blur_sd_mm, reader_sd_mm);
  const double skin_offset_mm =
      border_offset_mm(kAir_hu, soft_hu(TissueKind::skin), kSkin_hu, sd_mm);
  double bone_offset_mm[6];
  for (int kind = 0; kind < 6; ++kind) {
    bone_offset_mm[kind] =
        border_offset_mm(soft_hu(static_cast<TissueKind>(kind)), kCortical_hu, kBone_hu, sd_mm);
  }
  const Bed bed(body.skin, options);
  const CanonicalPlaces places(body, options.threads);
  const Rigid3 closed_from_open = body.open_from_closed.inverse();
  std::vector<float> values(grid.count());
  parallel_for(grid.size.z(), options.threads, [&](int k) {
    std::size_t at = grid.index(0, 0, k);
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i, ++at) {
        const Vector3d patient = grid.patient_from_voxel(Vector3d(i, j, k));
        const double outside_hu = bed.hu(patient);
        const double skin_mm = skin->distance_mm[at];
        if (skin_mm >= kBand_mm) {
          values[at] = static_cast<float>(outside_hu);
          continue;
        }
        const CanonicalPlace canonical = places.at(patient);
        const TissueKind kind = skin_mm > -1.5 ? TissueKind::skin : tissue.at(canonical.soft);
        double hu = soft_hu(kind);
        const double bone_mm = bone->distance_mm[at];
        if (bone_mm < kBand_mm) {
          const double share =
              inside_share(bone_mm - bone_offset_mm[static_cast<int>(kind)], voxel_sd_mm);
          hu += share * (bone_hu(-bone_mm, canonical.skull, closed_from_open) - hu);
        }
        const double share = inside_share(skin_mm - skin_offset_mm, voxel_sd_mm);
        values[at] = static_cast<float>(outside_hu + share * (hu - outside_hu));
      }
    }
  });
  if (progress.stop.stop_requested()) return cancelled();
  progress.report(0.8, "scanner");

  blur_volume(values, grid, blur_sd_mm, options.threads);
  add_metal(values, grid, options.metal_mm, options.streak_hu, options.threads);
  volume.hu = noisy_hu(values, grid, options.noise_sd_hu, options.seed, options.threads);
  if (options.padding_hu) {
    const double radius_mm =
        0.5 * std::max(grid.size.x() * grid.spacing_mm.x(), grid.size.y() * grid.spacing_mm.y());
    const Eigen::Vector2d center = 0.5 * (grid.size.head<2>().cast<double>().array() - 1.0);
    for (int k = 0; k < grid.size.z(); ++k) {
      for (int j = 0; j < grid.size.y(); ++j) {
        for (int i = 0; i < grid.size.x(); ++i) {
          const Eigen::Vector2d off =
              (Eigen::Vector2d(i, j) - center).cwiseProduct(grid.spacing_mm.head<2>());
          if (off.norm() > radius_mm) volume.at(i, j, k) = *options.padding_hu;
        }
      }
    }
  }
  volume.info.format = "phantom";
  volume.info.manufacturer = "Skullstation";
  volume.info.slice_thickness_mm = options.spacing_mm.z();
  progress.report(1.0, "scanner");
  return volume;
}

}  // namespace skullstation
