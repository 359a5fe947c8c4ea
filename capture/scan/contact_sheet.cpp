#include "capture/scan/contact_sheet.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <tuple>

#include "core/parallel.h"
#include "core/session/image_file.h"

namespace skullstation {

namespace {

/// Mean over the source pixels of each target pixel (RGB whatever the source is).
void shrink_into(const Image8& image, int x0, int y0, int width, int height, Image8& sheet) {
  for (int y = 0; y < height; ++y) {
    const int top = y * image.height / height;
    const int bottom = std::max(top + 1, (y + 1) * image.height / height);
    for (int x = 0; x < width; ++x) {
      const int left = x * image.width / width;
      const int right = std::max(left + 1, (x + 1) * image.width / width);
      for (int channel = 0; channel < 3; ++channel) {
        const int source = image.channels == 3 ? channel : 0;
        int sum = 0;
        for (int v = top; v < bottom; ++v) {
          for (int u = left; u < right; ++u) sum += image.at(u, v, source);
        }
        sheet.at(x0 + x, y0 + y, channel) =
            static_cast<std::uint8_t>(sum / ((bottom - top) * (right - left)));
      }
    }
  }
}

}  // namespace

Result<Image8> contact_sheet(const Session& session, const std::filesystem::path& folder,
                             int columns, int tile_width_px, int threads) {
  std::vector<const SessionView*> views;
  for (const SessionView& view : session.views) views.push_back(&view);
  std::stable_sort(views.begin(), views.end(), [](const auto* a, const auto* b) {
    return std::tie(a->pass, a->camera, a->table_angle_deg) <
           std::tie(b->pass, b->camera, b->table_angle_deg);
  });
  const SessionCamera& first = session.cameras.front();
  const int tile_height_px = std::max(1, tile_width_px * first.height / first.width);

  // Where each view's tile goes.
  std::vector<std::pair<int, int>> cells;  // column, row
  int column = 0;
  int row = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const bool new_ring =
        i > 0 && (views[i]->pass != views[i - 1]->pass || views[i]->camera != views[i - 1]->camera);
    if (column == columns || (new_ring && column > 0)) {
      column = 0;
      ++row;
    }
    cells.emplace_back(column++, row);
  }

  Image8 sheet(columns * tile_width_px, (row + 1) * tile_height_px, 3, 24);
  std::vector<std::optional<Error>> errors(views.size());
  parallel_for(static_cast<int>(views.size()), threads, [&](int i) {
    const auto image = read_image(folder / views[i]->image);
    if (!image) {
      errors[i] = image.error();
      return;
    }
    shrink_into(*image, cells[i].first * tile_width_px, cells[i].second * tile_height_px,
                tile_width_px, tile_height_px, sheet);
  });
  for (const auto& error : errors) {
    if (error) return tl::unexpected(*error);
  }
  return sheet;
}

}  // namespace skullstation
