#include "bench/photogrammetry/bench_views.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "core/parallel.h"
#include "core/random.h"
#include "core/session/image_file.h"
#include "core/session/session.h"

namespace skullstation {

namespace {

/// Each pixel the mean of four.
Image8 half_of(const Image8& image) {
  Image8 half(image.width / 2, image.height / 2, image.channels);
  for (int y = 0; y < half.height; ++y) {
    for (int x = 0; x < half.width; ++x) {
      for (int c = 0; c < image.channels; ++c) {
        const int sum = image.at(2 * x, 2 * y, c) + image.at(2 * x + 1, 2 * y, c) +
                        image.at(2 * x, 2 * y + 1, c) + image.at(2 * x + 1, 2 * y + 1, c);
        half.at(x, y, c) = static_cast<std::uint8_t>((sum + 2) / 4);
      }
    }
  }
  return half;
}

void add_noise(Image8& image, double sd, std::uint64_t seed) {
  Random random(seed);
  for (std::uint8_t& level : image.pixels) {
    const double noisy = std::round(level + random.normal(0.0, sd));
    level = static_cast<std::uint8_t>(std::clamp(noisy, 0.0, 255.0));
  }
}

Result<StereoView> load_view(const Session& session, std::size_t number,
                             const std::filesystem::path& folder, const BenchViewOptions& options) {
  const SessionView& view = session.views[number];
  auto photograph = read_image(folder / view.image);
  if (!photograph) return forward(photograph);
  auto mask = read_image(folder / view.mask.value_or(""));
  if (!mask) return forward(mask);
  for (const SessionCamera& camera : session.cameras) {
    if (camera.id != view.camera || !camera.params || !view.camera_from_table) continue;
    Lens lens = Lens::from_params(camera.width, camera.height, camera.model, *camera.params);
    for (int i = 0; i < options.halvings; ++i) {
      *photograph = half_of(*photograph);
      *mask = half_of(*mask);
      lens.width /= 2;
      lens.height /= 2;
      for (double* pixels : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *pixels *= 0.5;
    }
    if (options.noise_sd > 0.0) add_noise(*photograph, options.noise_sd, mix(options.seed, number));
    return make_stereo_view(view.image, *photograph, *mask, lens, *view.camera_from_table,
                            view.pass);
  }
  return fail(ErrorKind::bad_input, view.image, "has no intrinsics or no pose");
}

}  // namespace

Result<std::vector<StereoView>> load_bench_views(const std::filesystem::path& folder,
                                                 const BenchViewOptions& options) {
  const auto session = read_session(folder);
  if (!session) return forward(session);
  std::vector<std::size_t> chosen;
  std::map<std::string, int> of_ring;
  for (std::size_t i = 0; i < session->views.size(); ++i) {
    if (of_ring[session->views[i].camera]++ % options.every == 0) chosen.push_back(i);
  }
  const auto count = static_cast<int>(chosen.size());
  std::vector<std::optional<Result<StereoView>>> loaded(count);
  parallel_for(count, options.threads,
               [&](int i) { loaded[i] = load_view(*session, chosen[i], folder, options); });
  std::vector<StereoView> views;
  for (auto& view : loaded) {
    if (!*view) return forward(*view);
    views.push_back(**std::move(view));
  }
  return views;
}

}  // namespace skullstation
