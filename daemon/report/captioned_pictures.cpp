#include "daemon/report/captioned_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "reconstruction/rendering/picture_sheet.h"

namespace skullstation {

Result<void> add_sides(CaptionedPictures& pictures, std::span<const PicturedMesh> meshes,
                       std::initializer_list<std::string_view> sides, const std::string& caption,
                       const ReportPictureOptions& options) {
  std::vector<PictureSide> seen_from;
  for (const std::string_view name : sides) {
    for (const PictureSide& side : head_sides()) {
      if (name == side.name) seen_from.push_back(side);
    }
  }
  PictureOptions picture;
  picture.width = options.width_px;
  picture.height = options.width_px;
  picture.samples = options.samples;
  picture.threads = options.threads;
  auto rendered = render_sides(meshes, seen_from, picture);
  if (!rendered) return forward(rendered);
  for (std::size_t i = 0; i < seen_from.size(); ++i) {
    pictures.emplace_back(caption.empty() ? seen_from[i].name : caption + ", " + seen_from[i].name,
                          std::move((*rendered)[i]));
  }
  return {};
}

Colors scalar_colors(const Eigen::VectorXd& values, double low, double high) {
  constexpr std::array<std::array<double, 3>, 5> stops = {
      {{68, 1, 84}, {59, 82, 139}, {33, 145, 140}, {94, 201, 98}, {253, 231, 37}}};
  Colors colors(values.size(), 3);
  for (Eigen::Index v = 0; v < values.size(); ++v) {
    if (std::isnan(values[v])) {
      colors.row(v).setConstant(150);
      continue;
    }
    const double at = std::clamp((values[v] - low) / (high - low), 0.0, 1.0) * (stops.size() - 1.0);
    const auto stop = std::min(static_cast<std::size_t>(at), stops.size() - 2);
    const double share = at - static_cast<double>(stop);
    for (int c = 0; c < 3; ++c) {
      const auto channel = static_cast<std::size_t>(c);
      colors(v, c) = static_cast<std::uint8_t>(
          std::lround((1.0 - share) * stops[stop][channel] + share * stops[stop + 1][channel]));
    }
  }
  return colors;
}

}  // namespace skullstation
