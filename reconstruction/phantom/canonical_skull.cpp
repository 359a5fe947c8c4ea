#include "reconstruction/phantom/canonical_skull.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <span>
#include <string_view>
#include <utility>

#include "core/units.h"
#include "reconstruction/mesh/mesh_topology.h"
#include "reconstruction/phantom/isosurface.h"
#include "reconstruction/phantom/sculpture.h"
#include "reconstruction/phantom/skull_strokes.h"

namespace skullstation {

namespace {

/// Cartilage and enamel contacts: what keeps the two bones apart.
constexpr double kGap_mm = 0.4;

/// Centre of the canonical condyles in the midsagittal plane: the hinge of the jaw.
const Eigen::Vector3d kHinge_mm(0.0, -13.0, -5.0);

Stroke stroke_of(const StrokeRow& row) {
  Stroke stroke;
  stroke.tool = row.tool;
  stroke.form = row.form;
  stroke.paired = row.paired;
  stroke.center_mm = Eigen::Vector3d(row.center_mm);
  stroke.half_size_mm = Eigen::Vector3d(row.half_size_mm);
  stroke.rotation_deg = Eigen::Vector3d(row.rotation_deg);
  stroke.rounding_mm = row.rounding_mm;
  stroke.blend_mm = row.blend_mm;
  return stroke;
}

Stroke one_of_pair(const Stroke& paired, bool left) {
  Stroke stroke = paired;
  stroke.paired = false;
  if (!left) {
    stroke.center_mm.x() *= -1.0;
    // The mirror image of a turn is the turn about the mirrored axis the other way round.
    stroke.rotation_deg = {stroke.rotation_deg.x(), -stroke.rotation_deg.y(),
                           -stroke.rotation_deg.z()};
  }
  return stroke;
}

/// Position of the tooth in its quadrant, 1 .. 7 (FDI), or 0 if the part is no tooth.
int tooth_position(std::string_view part) {
  constexpr std::array<std::string_view, 7> kKinds = {
      "incisor 1", "incisor 2", "canine", "premolar 1", "premolar 2", "molar 1", "molar 2"};
  if (!part.starts_with("upper ") && !part.starts_with("lower ")) return 0;
  part.remove_prefix(6);
  for (std::size_t i = 0; i < kKinds.size(); ++i) {
    if (part.starts_with(kKinds[i])) return static_cast<int>(i) + 1;
  }
  return 0;
}

/// FDI's first digit.
int quadrant(bool upper, bool left) {
  if (upper) return left ? 2 : 1;
  return left ? 3 : 4;
}

Sculpture sculpt(std::span<const StrokeRow> rows, const SkullShape& shape) {
  const auto missing = [&](bool upper, bool left, int position) {
    return std::ranges::count(shape.missing_teeth, 10 * quadrant(upper, left) + position) > 0;
  };
  std::vector<Stroke> strokes;
  for (const StrokeRow& row : rows) {
    Stroke stroke = stroke_of(row);
    if (row.part == "cavity") {
      stroke.half_size_mm.array() -= shape.extra_vault_thickness_mm;
    }
    if (const int position = tooth_position(row.part); position > 0) {
      const bool upper = row.part.starts_with("upper");
      const bool left_missing = missing(upper, true, position);
      const bool right_missing = missing(upper, false, position);
      if (left_missing && right_missing) continue;
      if (left_missing || right_missing) stroke = one_of_pair(stroke, right_missing);
    }
    strokes.push_back(stroke);
  }
  return Sculpture(strokes);
}

/// A solid moved as a whole.
class MovedSolid final : public ImplicitSolid {
 public:
  MovedSolid(std::unique_ptr<ImplicitSolid> solid, const Rigid3& model_from_solid)
      : solid_(std::move(solid)),
        model_from_solid_(model_from_solid),
        solid_from_model_(model_from_solid.inverse()) {}

  double distance_mm(const Eigen::Vector3d& point) const override {
    return solid_->distance_mm(solid_from_model_ * point);
  }
  Eigen::AlignedBox3d bounds() const override {
    const Eigen::AlignedBox3d own = solid_->bounds();
    Eigen::AlignedBox3d box;
    for (int corner = 0; corner < 8; ++corner) {
      box.extend(model_from_solid_ *
                 own.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
    }
    return box;
  }
  std::unique_ptr<ImplicitSolid> near_ball(const Eigen::Vector3d& center, double radius_mm,
                                           double band_mm) const override {
    return std::make_unique<MovedSolid>(
        solid_->near_ball(solid_from_model_ * center, radius_mm, band_mm), model_from_solid_);
  }

 private:
  std::unique_ptr<ImplicitSolid> solid_;
  Rigid3 model_from_solid_;
  Rigid3 solid_from_model_;
};

/// A solid without what comes closer than `gap_mm` to another.
class ApartSolid final : public ImplicitSolid {
 public:
  ApartSolid(std::unique_ptr<ImplicitSolid> solid, std::unique_ptr<ImplicitSolid> other,
             double gap_mm)
      : solid_(std::move(solid)), other_(std::move(other)), gap_mm_(gap_mm) {}

  double distance_mm(const Eigen::Vector3d& point) const override {
    return std::max(solid_->distance_mm(point), gap_mm_ - other_->distance_mm(point));
  }
  Eigen::AlignedBox3d bounds() const override { return solid_->bounds(); }
  std::unique_ptr<ImplicitSolid> near_ball(const Eigen::Vector3d& center, double radius_mm,
                                           double band_mm) const override {
    return std::make_unique<ApartSolid>(solid_->near_ball(center, radius_mm, band_mm),
                                        other_->near_ball(center, radius_mm, band_mm + gap_mm_),
                                        gap_mm_);
  }

 private:
  std::unique_ptr<ImplicitSolid> solid_;
  std::unique_ptr<ImplicitSolid> other_;
  double gap_mm_;
};

}  // namespace

std::vector<Tooth> canonical_teeth() {
  std::map<int, Tooth> teeth;
  for (const auto& rows : {cranium_strokes(), mandible_strokes()}) {
    for (const StrokeRow& row : rows) {
      const int position = tooth_position(row.part);
      if (position == 0) continue;
      const bool upper = row.part.starts_with("upper");
      for (const bool left : {true, false}) {
        const int fdi = 10 * quadrant(upper, left) + position;
        Tooth& tooth = teeth[fdi];
        tooth.fdi = fdi;
        tooth.upper = upper;
        (row.part.ends_with("root") ? tooth.root_mm : tooth.crown_mm) =
            one_of_pair(stroke_of(row), left).center_mm;
      }
    }
  }
  std::vector<Tooth> found;
  for (const auto& [fdi, tooth] : teeth) found.push_back(tooth);
  return found;
}

Rigid3 mandible_opening(double opening_deg) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(radians(opening_deg), Eigen::Vector3d::UnitX()));
  return {turn, kHinge_mm - turn * kHinge_mm};
}

SkullSolids skull_solids(const SkullShape& shape) {
  assert(shape.mandible_opening_deg >= 0.0 && shape.mandible_opening_deg <= 35.0);
  assert(std::abs(shape.extra_vault_thickness_mm) <= 3.0);
  SkullSolids skull;
  skull.cranium = std::make_unique<Sculpture>(sculpt(cranium_strokes(), shape));
  skull.mandible = std::make_unique<ApartSolid>(
      std::make_unique<MovedSolid>(std::make_unique<Sculpture>(sculpt(mandible_strokes(), shape)),
                                   mandible_opening(shape.mandible_opening_deg)),
      std::make_unique<Sculpture>(sculpt(cranium_strokes(), shape)), kGap_mm);
  return skull;
}

double skull_distance_mm(const SkullSolids& skull, const Eigen::Vector3d& point) {
  return std::min(skull.cranium->distance_mm(point), skull.mandible->distance_mm(point));
}

SkullMeshes skull_meshes(const SkullSolids& skull, double edge_mm, int threads) {
  const IsosurfaceOptions options{.cell_mm = edge_mm, .threads = threads};
  return {largest_component(isosurface(*skull.cranium, options)),
          largest_component(isosurface(*skull.mandible, options))};
}

TriangleMesh canonical_skull(double edge_mm, int threads) {
  return whole_skull(skull_meshes(skull_solids(), edge_mm, threads));
}

TriangleMesh whole_skull(const SkullMeshes& skull) {
  const TriangleMesh& a = skull.cranium;
  const TriangleMesh& b = skull.mandible;
  TriangleMesh mesh;
  mesh.vertices.resize(a.vertices.rows() + b.vertices.rows(), 3);
  mesh.vertices << a.vertices, b.vertices;
  mesh.normals.resize(a.normals.rows() + b.normals.rows(), 3);
  mesh.normals << a.normals, b.normals;
  mesh.triangles.resize(a.triangles.rows() + b.triangles.rows(), 3);
  mesh.triangles << a.triangles,
      (b.triangles.array() + static_cast<int>(a.vertices.rows())).matrix();
  return mesh;
}

}  // namespace skullstation
