#pragma once

#include <opencv2/core.hpp>
#include <string>
#include <vector>

namespace skullstation {

/// What is used of OpenCV's ArUco module, kept in one place since its interface differs between
/// OpenCV 4.6 and 4.10. Only the markers' bits and their detection: the board's pattern and frame
/// are our own (OpenCV changed both). For .cpp files of this folder only.

/// A dictionary's markers as OpenCV stores them; empty for an unknown name.
struct ArucoMarkers {
  cv::Mat bytes;  ///< one row a marker
  int bits = 0;   ///< along a side
  int correctable_bits = 0;
};
ArucoMarkers aruco_markers(const std::string& dictionary);

/// White bits of one marker: bits x bits, CV_8U, 0 or 1.
cv::Mat aruco_marker_bits(const ArucoMarkers& markers, int id);

struct ArucoDetection {
  int id = 0;
  /// Top left, top right, bottom right, bottom left on the page; OpenCV's pixel convention.
  std::vector<cv::Point2f> corners_cv;
};

/// Markers with ids below `count` in a CV_8U image, clockwise as a camera sees paper's front.
std::vector<ArucoDetection> detect_aruco(const cv::Mat& grey, const ArucoMarkers& markers,
                                         int count);

}  // namespace skullstation
