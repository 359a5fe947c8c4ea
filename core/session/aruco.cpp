#include "core/session/aruco.h"

#include <algorithm>
#include <array>
#include <opencv2/aruco.hpp>
#include <string_view>
#include <utility>

namespace skullstation {

namespace {

constexpr std::array<std::pair<std::string_view, int>, 21> predefined{{
    {"DICT_4X4_50", cv::aruco::DICT_4X4_50},
    {"DICT_4X4_100", cv::aruco::DICT_4X4_100},
    {"DICT_4X4_250", cv::aruco::DICT_4X4_250},
    {"DICT_4X4_1000", cv::aruco::DICT_4X4_1000},
    {"DICT_5X5_50", cv::aruco::DICT_5X5_50},
    {"DICT_5X5_100", cv::aruco::DICT_5X5_100},
    {"DICT_5X5_250", cv::aruco::DICT_5X5_250},
    {"DICT_5X5_1000", cv::aruco::DICT_5X5_1000},
    {"DICT_6X6_50", cv::aruco::DICT_6X6_50},
    {"DICT_6X6_100", cv::aruco::DICT_6X6_100},
    {"DICT_6X6_250", cv::aruco::DICT_6X6_250},
    {"DICT_6X6_1000", cv::aruco::DICT_6X6_1000},
    {"DICT_7X7_50", cv::aruco::DICT_7X7_50},
    {"DICT_7X7_100", cv::aruco::DICT_7X7_100},
    {"DICT_7X7_250", cv::aruco::DICT_7X7_250},
    {"DICT_7X7_1000", cv::aruco::DICT_7X7_1000},
    {"DICT_ARUCO_ORIGINAL", cv::aruco::DICT_ARUCO_ORIGINAL},
    {"DICT_APRILTAG_16h5", cv::aruco::DICT_APRILTAG_16h5},
    {"DICT_APRILTAG_25h9", cv::aruco::DICT_APRILTAG_25h9},
    {"DICT_APRILTAG_36h10", cv::aruco::DICT_APRILTAG_36h10},
    {"DICT_APRILTAG_36h11", cv::aruco::DICT_APRILTAG_36h11},
}};

// OpenCV 4.6 hands dictionaries out by pointer, 4.7 and later by value.
const cv::aruco::Dictionary& value_of(const cv::Ptr<cv::aruco::Dictionary>& pointer) {
  return *pointer;
}
[[maybe_unused]] const cv::aruco::Dictionary& value_of(const cv::aruco::Dictionary& value) {
  return value;
}

cv::Ptr<cv::aruco::DetectorParameters> parameters_for(const cv::Mat& grey) {
  auto parameters = cv::makePtr<cv::aruco::DetectorParameters>();
  const int longer_side = std::max(grey.cols, grey.rows);
  // A threshold window works for markers from about its own size (a smaller one hollows the black
  // border out) down to a few pixels: windows from 5 px to a tenth of the image, each twice the
  // last one would do; OpenCV only takes equal steps.
  parameters->adaptiveThreshWinSizeMin = 5;
  parameters->adaptiveThreshWinSizeMax = std::max(23, longer_side / 25) | 1;
  parameters->adaptiveThreshWinSizeStep =
      std::max(10, (parameters->adaptiveThreshWinSizeMax - 5) / 4);
  parameters->adaptiveThreshConstant = 5.0;
  // Below 10 px a side the bits can't be read.
  parameters->minMarkerPerimeterRate = std::min(0.03, 40.0 / longer_side);
  // Corners are fitted later; the outline may bend with the lens and be ragged with noise.
  parameters->polygonalApproxAccuracyRate = 0.05;
  parameters->minCornerDistanceRate = 0.03;
  parameters->minDistanceToBorder = 1;
  parameters->perspectiveRemovePixelPerCell = 6;
  parameters->perspectiveRemoveIgnoredMarginPerCell = 0.2;
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_NONE;
  return parameters;
}

}  // namespace

ArucoMarkers aruco_markers(const std::string& dictionary) {
  const auto* const found = std::find_if(predefined.begin(), predefined.end(),
                                         [&](const auto& d) { return d.first == dictionary; });
  if (found == predefined.end()) return {};
  const auto loaded = cv::aruco::getPredefinedDictionary(found->second);
  const cv::aruco::Dictionary& markers = value_of(loaded);
  return {markers.bytesList.clone(), markers.markerSize, markers.maxCorrectionBits};
}

cv::Mat aruco_marker_bits(const ArucoMarkers& markers, int id) {
  return cv::aruco::Dictionary::getBitsFromByteList(markers.bytes.rowRange(id, id + 1),
                                                    markers.bits);
}

std::vector<ArucoDetection> detect_aruco(const cv::Mat& grey, const ArucoMarkers& markers,
                                         int count) {
  // Only the board's own markers: fewer ids mean fewer chance matches.
  const auto dictionary = cv::makePtr<cv::aruco::Dictionary>(
      markers.bytes.rowRange(0, count).clone(), markers.bits, markers.correctable_bits);
  std::vector<std::vector<cv::Point2f>> corners;
  std::vector<int> ids;
  cv::aruco::detectMarkers(grey, dictionary, corners, ids, parameters_for(grey));
  std::vector<ArucoDetection> detections;
  detections.reserve(ids.size());
  for (std::size_t i = 0; i < ids.size(); ++i) {
    detections.push_back({ids[i], std::move(corners[i])});
  }
  return detections;
}

}  // namespace skullstation
