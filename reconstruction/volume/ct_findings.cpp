#include "reconstruction/volume/ct_findings.h"

#include <fmt/format.h>

#include <algorithm>

namespace skullstation {

namespace {

constexpr double thickest_slice_mm = 1.0;
constexpr double least_cut_mm2 = 100.0;
constexpr double least_front_contact_mm2 = 150.0;
constexpr double least_back_contact_mm2 = 2500.0;

/// Area of the head on the grid's first or last layer along an axis.
double cut_area_mm2(const VoxelMask& head, const Eigen::Vector3d& spacing_mm, int axis,
                    bool at_end) {
  const int layer = at_end ? head.size[axis] - 1 : 0;
  const int a = (axis + 1) % 3;
  const int b = (axis + 2) % 3;
  std::size_t on = 0;
  for (int y = 0; y < head.size[b]; ++y) {
    for (int x = 0; x < head.size[a]; ++x) {
      Eigen::Vector3i at;
      at[axis] = layer;
      at[a] = x;
      at[b] = y;
      on += head.at(at.x(), at.y(), at.z()) ? 1 : 0;
    }
  }
  return static_cast<double>(on) * spacing_mm[a] * spacing_mm[b];
}

}  // namespace

const char* to_string(CtWarning warning) {
  switch (warning) {
    case CtWarning::cropped_vertex: return "cropped vertex";
    case CtWarning::cropped_nose: return "cropped nose";
    case CtWarning::cropped_side: return "cropped side";
    case CtWarning::no_mandible: return "no mandible";
    case CtWarning::thick_slices: return "thick slices";
    case CtWarning::metal_streaks: return "metal streaks";
    case CtWarning::compressed_tissue: return "compressed tissue";
    case CtWarning::spine_not_separated: return "spine not separated";
    case CtWarning::open_surface: return "open surface";
  }
  return "";
}

void add_findings(const Volume& volume, const VoxelMask& head, bool mandible_found,
                  bool canal_found, CtQuality& quality) {
  const auto add = [&](CtWarning warning, std::string text) {
    quality.findings.push_back({warning, std::move(text)});
  };
  const Eigen::Vector3d& spacing_mm = volume.grid.spacing_mm;
  const double top_mm2 = cut_area_mm2(head, spacing_mm, 2, true);
  if (top_mm2 > least_cut_mm2) {
    add(CtWarning::cropped_vertex,
        fmt::format("the scan ends below the vertex: {:.0f} mm^2 of the head lie in its top slice",
                    top_mm2));
  }
  const double front_mm2 = cut_area_mm2(head, spacing_mm, 1, false);
  if (front_mm2 > least_cut_mm2) {
    add(CtWarning::cropped_nose,
        fmt::format("the face runs out of the image in front: {:.0f} mm^2 are cut", front_mm2));
  }
  const double side_mm2 = cut_area_mm2(head, spacing_mm, 0, false) +
                          cut_area_mm2(head, spacing_mm, 0, true) +
                          cut_area_mm2(head, spacing_mm, 1, true);
  if (side_mm2 > least_cut_mm2) {
    add(CtWarning::cropped_side,
        fmt::format("the head runs out of the image at the sides or behind: {:.0f} mm^2 are cut",
                    side_mm2));
  }
  const double slice_mm =
      std::max(spacing_mm.z(), volume.info.slice_thickness_mm.value_or(spacing_mm.z()));
  if (slice_mm > thickest_slice_mm + 1e-3) {
    add(CtWarning::thick_slices,
        fmt::format("slices of {:.2f} mm; at most {:.0f} mm are asked for (Gietzen et al. 2019)",
                    slice_mm, thickest_slice_mm));
  }
  if (!canal_found) {
    add(CtWarning::spine_not_separated,
        "the cranial cavity was not found, so vertebrae may be left on the skull");
  } else if (!mandible_found) {
    add(CtWarning::no_mandible, "there is no mandible below the skull");
  }
  if (!quality.streaks.empty()) {
    std::string slices;
    for (const StreakedSlices& stack : quality.streaks) {
      slices += fmt::format("{}{} to {}", slices.empty() ? "" : ", ", stack.first, stack.last);
    }
    add(CtWarning::metal_streaks,
        fmt::format("streaks from metal in slices {}, counted from the feet", slices));
  }
  if (quality.contact_front_mm2 > least_front_contact_mm2) {
    add(CtWarning::compressed_tissue,
        fmt::format("something presses on the face: {:.0f} mm^2 of contact in front",
                    quality.contact_front_mm2));
  } else if (quality.contact_back_mm2 > least_back_contact_mm2) {
    add(CtWarning::compressed_tissue,
        fmt::format("the head rests on {:.0f} mm^2 of its back", quality.contact_back_mm2));
  }
}

}  // namespace skullstation
