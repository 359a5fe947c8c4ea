#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace skullstation {

/// Row-major, interleaved pixels without padding: `at(x, y, channel)`. Pixel (0.5, 0.5) is the
/// centre of the top-left pixel, as in COLMAP. Three channels mean RGB.
template <class T>
struct Image {
  int width = 0;
  int height = 0;
  int channels = 0;
  std::vector<T> pixels;

  Image() = default;
  Image(int width_px, int height_px, int channel_count, T fill = T{})
      : width(width_px),
        height(height_px),
        channels(channel_count),
        pixels(static_cast<std::size_t>(width_px) * height_px * channel_count, fill) {}

  bool empty() const { return pixels.empty(); }
  T& at(int x, int y, int channel = 0) { return pixels[index(x, y, channel)]; }
  const T& at(int x, int y, int channel = 0) const { return pixels[index(x, y, channel)]; }
  T* row(int y) { return pixels.data() + index(0, y, 0); }
  const T* row(int y) const { return pixels.data() + index(0, y, 0); }

  bool operator==(const Image&) const = default;

 private:
  std::size_t index(int x, int y, int channel) const {
    return (static_cast<std::size_t>(y) * width + x) * channels + channel;
  }
};

using Image8 = Image<std::uint8_t>;
using Image16 = Image<std::uint16_t>;
using ImageF = Image<float>;

}  // namespace skullstation
