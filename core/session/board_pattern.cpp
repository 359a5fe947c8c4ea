#include "core/session/board_pattern.h"

#include "core/session/aruco.h"

namespace skullstation {

std::optional<MarkerDictionary> marker_dictionary(const std::string& name) {
  const ArucoMarkers markers = aruco_markers(name);
  if (markers.bytes.empty()) return std::nullopt;
  return MarkerDictionary{name, markers.bytes.rows, markers.bits};
}

Image8 marker_bits(const MarkerDictionary& dictionary, int id) {
  const cv::Mat bits = aruco_marker_bits(aruco_markers(dictionary.name), id);
  Image8 image(bits.cols, bits.rows, 1);
  for (int y = 0; y < bits.rows; ++y) {
    for (int x = 0; x < bits.cols; ++x) {
      image.at(x, y) = bits.at<std::uint8_t>(y, x) != 0 ? 255 : 0;
    }
  }
  return image;
}

}  // namespace skullstation
