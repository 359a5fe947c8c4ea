#include <fmt/format.h>

#include <atomic>
#include <cmath>
#include <cstddef>

#include "capture/simulation/render.h"
#include "core/parallel.h"

namespace skullstation {

namespace {

tl::unexpected<Error> bad_optics(const std::string& what) {
  return fail(ErrorKind::bad_input, "simulated camera, optics", what);
}

}  // namespace

Result<void> CameraOptics::validate() const {
  if (lens.width < 1 || lens.height < 1) return bad_optics("width and height must be positive");
  if (!(lens.fx > 0.0 && lens.fy > 0.0)) return bad_optics("fx and fy must be positive");
  if (!(aperture_mm >= 0.0)) return bad_optics("aperture_mm must not be negative");
  if (!(focus_distance_mm > 0.0)) return bad_optics("focus_distance_mm must be positive");
  if (!(vignetting >= 0.0)) return bad_optics("vignetting must not be negative");
  return {};
}

Result<PreparedOptics> PreparedOptics::prepare(const CameraOptics& optics, int threads) {
  if (const auto sound = optics.validate(); !sound) return forward(sound);
  PreparedOptics prepared;
  prepared.optics_ = optics;
  const Lens& lens = optics.lens;
  const int stride = lens.width + 1;
  prepared.corner_rays_.resize(static_cast<std::size_t>(stride) * (lens.height + 1));
  std::atomic<bool> folded = false;
  parallel_for(lens.height + 1, threads, [&](int y) {
    for (int x = 0; x < stride; ++x) {
      const auto ray = lens.ray({x, y});
      if (!ray) {
        folded = true;
        return;
      }
      prepared.corner_rays_[static_cast<std::size_t>(y) * stride + x] = ray->head<2>();
    }
  });
  if (folded) return bad_optics("the lens's distortion folds inside the image");
  return prepared;
}

Eigen::Vector2d PreparedOptics::ray(double x_px, double y_px) const {
  const int x = std::min(static_cast<int>(x_px), optics_.lens.width - 1);
  const int y = std::min(static_cast<int>(y_px), optics_.lens.height - 1);
  const double u = x_px - x;
  const double v = y_px - y;
  const int stride = optics_.lens.width + 1;
  const Eigen::Vector2d* corner = corner_rays_.data() + static_cast<std::size_t>(y) * stride + x;
  return (1.0 - v) * ((1.0 - u) * corner[0] + u * corner[1]) +
         v * ((1.0 - u) * corner[stride] + u * corner[stride + 1]);
}

std::pair<Eigen::Vector2d, Eigen::Vector2d> PreparedOptics::pixel_size(int x, int y) const {
  const int stride = optics_.lens.width + 1;
  const Eigen::Vector2d* corner = corner_rays_.data() + static_cast<std::size_t>(y) * stride + x;
  return {corner[1] - corner[0], corner[stride] - corner[0]};
}

}  // namespace skullstation
