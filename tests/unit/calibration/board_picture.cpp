#include "tests/unit/calibration/board_picture.h"

#include <algorithm>
#include <cmath>

#include "core/random.h"
#include "core/units.h"

namespace skullstation::testing {

namespace {

/// Bilinear between texel centres; `x`, `y` in texels, (0.5, 0.5) the first one's centre.
double texel(const Image8& texture, double x, double y) {
  const double fx = std::clamp(x - 0.5, 0.0, texture.width - 1.0);
  const double fy = std::clamp(y - 0.5, 0.0, texture.height - 1.0);
  const int x0 = std::min(static_cast<int>(fx), texture.width - 2);
  const int y0 = std::min(static_cast<int>(fy), texture.height - 2);
  const double ax = fx - x0;
  const double ay = fy - y0;
  return (1 - ay) * ((1 - ax) * texture.at(x0, y0) + ax * texture.at(x0 + 1, y0)) +
         ay * ((1 - ax) * texture.at(x0, y0 + 1) + ax * texture.at(x0 + 1, y0 + 1));
}

void blur_rows(ImageF& image, double sd) {
  const int reach = static_cast<int>(std::ceil(4.0 * sd));
  std::vector<float> kernel;
  float sum = 0.0F;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sd * sd))));
    sum += kernel.back();
  }
  std::vector<float> row(static_cast<std::size_t>(image.width));
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      float value = 0.0F;
      for (int i = -reach; i <= reach; ++i) {
        value += kernel[static_cast<std::size_t>(i + reach)] *
                 image.at(std::clamp(x + i, 0, image.width - 1), y);
      }
      row[static_cast<std::size_t>(x)] = value / sum;
    }
    std::copy(row.begin(), row.end(), image.row(y));
  }
}

ImageF transposed(const ImageF& image) {
  ImageF result(image.height, image.width, 1);
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) result.at(y, x) = image.at(x, y);
  }
  return result;
}

}  // namespace

Image8 photograph(const BoardPicture& picture, const CharucoBoard& board, std::uint64_t seed) {
  constexpr int texels_per_square = 64;
  const Image8 print = draw_board(board, texels_per_square);
  const Lens& lens = picture.lens;
  const Rigid3 board_from_camera = picture.camera_from_board.inverse();
  const Eigen::Vector3d eye = board_from_camera.translation;

  // Rays through pixel corners; inside a pixel they are as good as linear.
  const auto corner_ray = [&](int x, int y) {
    const auto ray = lens.ray({static_cast<double>(x), static_cast<double>(y)});
    return ray ? Eigen::Vector3d(board_from_camera.rotation * *ray) : Eigen::Vector3d(0, 0, 1);
  };
  std::vector<Eigen::Vector3d> above(static_cast<std::size_t>(lens.width + 1));
  std::vector<Eigen::Vector3d> below(above.size());
  for (int x = 0; x <= lens.width; ++x) below[static_cast<std::size_t>(x)] = corner_ray(x, 0);

  ImageF image(lens.width, lens.height, 1);
  const int n = picture.samples;
  for (int y = 0; y < lens.height; ++y) {
    above.swap(below);
    for (int x = 0; x <= lens.width; ++x) below[static_cast<std::size_t>(x)] = corner_ray(x, y + 1);
    for (int x = 0; x < lens.width; ++x) {
      const auto i = static_cast<std::size_t>(x);
      double sum = 0.0;
      for (int sample = 0; sample < n * n; ++sample) {
        const double ax = (sample % n + 0.5) / n;
        const double ay = (sample / n + 0.5) / n;
        double level = picture.background;
        if (!picture.hidden(x + ax, y + ay)) {
          const Eigen::Vector3d ray = (1 - ay) * ((1 - ax) * above[i] + ax * above[i + 1]) +
                                      ay * ((1 - ax) * below[i] + ax * below[i + 1]);
          const Eigen::Vector3d point = eye - ray * (eye.z() / ray.z());
          const double u = point.x() + 0.5 * board.width_mm();
          const double v = 0.5 * board.height_mm() - point.y();
          const bool hit = ray.z() * eye.z() < 0.0 && u > 0.0 && v > 0.0 && u < board.width_mm() &&
                           v < board.height_mm();
          if (hit) {
            const double scale = texels_per_square / board.square_mm;
            level = picture.black +
                    (picture.white - picture.black) / 255.0 * texel(print, u * scale, v * scale);
          }
        }
        sum += level;
      }
      image.at(x, y) = static_cast<float>(sum / (n * n) * picture.light(x + 0.5, y + 0.5));
    }
  }
  if (picture.blur_px > 0.0) {
    blur_rows(image, picture.blur_px);
    image = transposed(image);
    blur_rows(image, picture.blur_px);
    image = transposed(image);
  }
  Random random(seed);
  Image8 result(lens.width, lens.height, 1);
  for (std::size_t i = 0; i < image.pixels.size(); ++i) {
    const double noise = picture.noise_sd > 0.0 ? picture.noise_sd * random.normal() : 0.0;
    result.pixels[i] =
        static_cast<std::uint8_t>(std::lround(std::clamp(image.pixels[i] + noise, 0.0, 255.0)));
  }
  return result;
}

Rigid3 camera_looking_at(const Eigen::Vector2d& target_mm, double distance_mm, double elevation_deg,
                         double azimuth_deg, double roll_deg) {
  const double elevation = radians(elevation_deg);
  const double azimuth = radians(azimuth_deg);
  const Eigen::Vector3d target(target_mm.x(), target_mm.y(), 0.0);
  const Eigen::Vector3d towards_camera(std::cos(elevation) * std::sin(azimuth),
                                       -std::cos(elevation) * std::cos(azimuth),
                                       std::sin(elevation));
  const Eigen::Vector3d right(std::cos(azimuth), std::sin(azimuth), 0.0);
  Eigen::Matrix3d board_from_camera;
  board_from_camera.col(2) = -towards_camera;
  board_from_camera.col(0) = right;
  board_from_camera.col(1) = board_from_camera.col(2).cross(right);
  const Rigid3 pose{Eigen::Quaterniond(board_from_camera), target + distance_mm * towards_camera};
  return rotation_about_z(roll_deg) * pose.inverse();
}

std::vector<Eigen::Vector2d> true_corners(const BoardPicture& picture, const CharucoBoard& board) {
  std::vector<Eigen::Vector2d> corners;
  for (int id = 0; id < board.corner_count(); ++id) {
    corners.push_back(picture.lens.project(picture.camera_from_board * board.corner(id)));
  }
  return corners;
}

}  // namespace skullstation::testing
