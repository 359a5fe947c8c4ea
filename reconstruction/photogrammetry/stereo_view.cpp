#include "reconstruction/photogrammetry/stereo_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <vector>

namespace skullstation {

namespace {

struct PixelBox {
  int left = 0, top = 0, right = 0, bottom = 0;  ///< right and bottom lie outside
};

/// Where the mask is not black; nothing if it is all black.
std::optional<PixelBox> box_of(const Image8& mask) {
  PixelBox box{mask.width, mask.height, 0, 0};
  for (int y = 0; y < mask.height; ++y) {
    for (int x = 0; x < mask.width; ++x) {
      if (mask.at(x, y) == 0) continue;
      box = {std::min(box.left, x), std::min(box.top, y), std::max(box.right, x + 1),
             std::max(box.bottom, y + 1)};
    }
  }
  if (box.left >= box.right) return std::nullopt;
  return box;
}

bool touches_border(const Image8& mask) {
  for (int x = 0; x < mask.width; ++x) {
    if (mask.at(x, 0) != 0 || mask.at(x, mask.height - 1) != 0) return true;
  }
  for (int y = 0; y < mask.height; ++y) {
    if (mask.at(0, y) != 0 || mask.at(mask.width - 1, y) != 0) return true;
  }
  return false;
}

/// Pinhole camera of the lens's focal lengths whose image holds the box undistorted, whole.
Result<Pinhole> cut_camera(const std::string& name, const Lens& lens, const PixelBox& box,
                           int margin_px) {
  double left = 1e9, top = 1e9, right = -1e9, bottom = -1e9;
  // Distortion may bow the box's sides: its border is followed at some distance.
  constexpr int kSteps = 32;
  for (int i = 0; i <= kSteps; ++i) {
    const double x = box.left + (box.right - box.left) * (i / double{kSteps});
    const double y = box.top + (box.bottom - box.top) * (i / double{kSteps});
    const Eigen::Vector2d border[] = {{x, double(box.top)},
                                      {x, double(box.bottom)},
                                      {double(box.left), y},
                                      {double(box.right), y}};
    for (const Eigen::Vector2d& point : border) {
      const auto ray = lens.ray(point);
      if (!ray) {
        return fail(ErrorKind::bad_input, name, "the lens's distortion folds inside the image",
                    "check the camera's params");
      }
      const double u = lens.fx * ray->x() + lens.cx;
      const double v = lens.fy * ray->y() + lens.cy;
      left = std::min(left, u);
      right = std::max(right, u);
      top = std::min(top, v);
      bottom = std::max(bottom, v);
    }
  }
  // Even offsets, so that the reduced images of the pyramid are cut at whole pixels.
  const int x0 = static_cast<int>(std::floor(left / 8.0)) * 8 - (margin_px + 7) / 8 * 8;
  const int y0 = static_cast<int>(std::floor(top / 8.0)) * 8 - (margin_px + 7) / 8 * 8;
  const int width = (static_cast<int>(std::ceil(right)) + margin_px - x0 + 7) / 8 * 8;
  const int height = (static_cast<int>(std::ceil(bottom)) + margin_px - y0 + 7) / 8 * 8;
  return Pinhole{width, height, lens.fx, lens.fy, lens.cx - x0, lens.cy - y0};
}

/// Weights of four neighbours for a point `t` in [0, 1) past the second (Keys 1981, a = -1/2).
std::array<float, 4> cubic_weights(float t) {
  const float t2 = t * t;
  const float t3 = t2 * t;
  return {0.5f * (-t3 + 2.0f * t2 - t), 0.5f * (3.0f * t3 - 5.0f * t2 + 2.0f),
          0.5f * (-3.0f * t3 + 4.0f * t2 + t), 0.5f * (t3 - t2)};
}

/// Samples all channels at the image point; the border is repeated outside.
void sample(const Image8& image, const Eigen::Vector2d& point, std::uint8_t* out) {
  const auto u = static_cast<float>(point.x() - 0.5);
  const auto v = static_cast<float>(point.y() - 0.5);
  const float fu = std::floor(u);
  const float fv = std::floor(v);
  const auto wx = cubic_weights(u - fu);
  const auto wy = cubic_weights(v - fv);
  float sum[3] = {0.0f, 0.0f, 0.0f};
  for (int j = 0; j < 4; ++j) {
    const int y = std::clamp(static_cast<int>(fv) + j - 1, 0, image.height - 1);
    for (int i = 0; i < 4; ++i) {
      const int x = std::clamp(static_cast<int>(fu) + i - 1, 0, image.width - 1);
      for (int c = 0; c < image.channels; ++c) sum[c] += wy[j] * wx[i] * image.at(x, y, c);
    }
  }
  for (int c = 0; c < image.channels; ++c) {
    out[c] = static_cast<std::uint8_t>(std::clamp(sum[c] + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace

Pinhole Pinhole::reduced(int level) const {
  const double scale = std::ldexp(1.0, -level);
  return {width >> level, height >> level, fx * scale, fy * scale, cx * scale, cy * scale};
}

Result<StereoView> make_stereo_view(const std::string& name, const Image8& photograph,
                                    const Image8& mask, const Lens& lens,
                                    const Rigid3& camera_from_table, int pass, int margin_px) {
  const auto matches = [&](const Image8& image) {
    return image.width == lens.width && image.height == lens.height;
  };
  if (!matches(photograph) || (!mask.empty() && (!matches(mask) || mask.channels != 1))) {
    return fail(ErrorKind::bad_input, name, "photograph, mask and camera differ in size",
                "all three must have the camera's width and height, the mask one channel");
  }
  const auto box = mask.empty() ? PixelBox{0, 0, lens.width, lens.height} : box_of(mask);
  if (!box) {
    return fail(ErrorKind::bad_input, name, "the mask is black: no specimen in this view",
                "leave the view out or give it a mask that is white on the specimen");
  }
  const auto camera = cut_camera(name, lens, *box, margin_px);
  if (!camera) return forward(camera);

  StereoView view{name,
                  pass,
                  *camera,
                  camera_from_table,
                  Image8(camera->width, camera->height, photograph.channels),
                  Image8(camera->width, camera->height, 1),
                  mask.empty() || touches_border(mask)};
  for (int y = 0; y < camera->height; ++y) {
    for (int x = 0; x < camera->width; ++x) {
      const Eigen::Vector2d point = lens.project(camera->ray(x + 0.5, y + 0.5));
      sample(photograph, point, &view.color.at(x, y));
      const bool inside =
          point.x() >= 0.0 && point.y() >= 0.0 && point.x() < lens.width && point.y() < lens.height;
      if (!inside) continue;
      if (mask.empty()) {
        view.mask.at(x, y) = 255;
      } else {
        sample(mask, point, &view.mask.at(x, y));
      }
    }
  }
  return view;
}

Image8 halved(const Image8& image) {
  Image8 half(image.width / 2, image.height / 2, 1);
  for (int y = 0; y < half.height; ++y) {
    const std::uint8_t* upper = image.row(2 * y);
    const std::uint8_t* lower = image.row(2 * y + 1);
    std::uint8_t* out = half.row(y);
    for (std::ptrdiff_t x = 0; x < half.width; ++x) {
      const int sum = upper[2 * x] + upper[2 * x + 1] + lower[2 * x] + lower[2 * x + 1];
      out[x] = static_cast<std::uint8_t>((sum + 2) / 4);
    }
  }
  return half;
}

Image8 without_shading(const Image8& grey, const Image8& mask, double blur_sd_px) {
  const int radius = static_cast<int>(std::ceil(2.5 * blur_sd_px));
  std::vector<float> kernel(2 * radius + 1);
  for (int i = -radius; i <= radius; ++i) {
    kernel[i + radius] = static_cast<float>(std::exp(-0.5 * i * i / (blur_sd_px * blur_sd_px)));
  }
  // Sums of weighted grey and of weights, first along the rows, then along the columns.
  const int width = grey.width;
  const int height = grey.height;
  ImageF row_sum(width, height, 1), row_weight(width, height, 1);
  std::vector<float> value(width + 2 * radius, 0.0f), weight(width + 2 * radius, 0.0f);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      weight[x + radius] = mask.at(x, y);
      value[x + radius] = weight[x + radius] * grey.at(x, y);
    }
    float* const sums = row_sum.row(y);
    float* const weights = row_weight.row(y);
    for (int i = 0; i <= 2 * radius; ++i) {
      for (int x = 0; x < width; ++x) {
        sums[x] += kernel[i] * value[x + i];
        weights[x] += kernel[i] * weight[x + i];
      }
    }
  }
  Image8 texture(width, height, 1, 128);
  std::vector<float> sum(width), total(width);
  for (int y = 0; y < height; ++y) {
    std::fill(sum.begin(), sum.end(), 0.0f);
    std::fill(total.begin(), total.end(), 0.0f);
    for (int i = -radius; i <= radius; ++i) {
      if (y + i < 0 || y + i >= height) continue;
      const float* const sums = row_sum.row(y + i);
      const float* const weights = row_weight.row(y + i);
      const float k = kernel[i + radius];
      for (int x = 0; x < width; ++x) {
        sum[x] += k * sums[x];
        total[x] += k * weights[x];
      }
    }
    for (int x = 0; x < width; ++x) {
      if (mask.at(x, y) < 64) continue;
      const float detail = 128.5f + 2.0f * (grey.at(x, y) - sum[x] / total[x]);
      texture.at(x, y) = static_cast<std::uint8_t>(std::clamp(detail, 0.0f, 255.0f));
    }
  }
  return texture;
}

Image8 grey_of(const Image8& image) {
  if (image.channels == 1) return image;
  Image8 grey(image.width, image.height, 1);
  for (std::size_t i = 0; i < grey.pixels.size(); ++i) {
    const std::uint8_t* p = &image.pixels[3 * i];
    grey.pixels[i] = static_cast<std::uint8_t>((77 * p[0] + 150 * p[1] + 29 * p[2] + 128) >> 8);
  }
  return grey;
}

}  // namespace skullstation
