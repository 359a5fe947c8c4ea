#include "reconstruction/phantom/skull_strokes.h"

namespace skullstation {

namespace {

constexpr Stroke::Tool kAdd = Stroke::Tool::add;
constexpr Stroke::Tool kCarve = Stroke::Tool::carve;
constexpr Stroke::Form kEllipsoid = Stroke::Form::ellipsoid;
constexpr Stroke::Form kSlab = Stroke::Form::slab;
constexpr bool kPaired = true;
constexpr bool kMedian = false;

// clang-format off
// part, tool, form, side, center [mm], half size [mm], rotation vector [deg], rounding [mm], blend [mm]
constexpr StrokeRow kStrokes[] = {
    {"mandible", kAdd, kEllipsoid, kPaired, {36.88, -38.66, -37.62}, {9.58, 4.79, 23.94}, {-28.71, 50.05, 79.95}, 0.00, 8.62},
    {"mandible", kAdd, kEllipsoid, kMedian, {0.00, -87.71, -65.47}, {5.85, 5.28, 6.09}, {-121.09, 0.00, 0.00}, 0.00, 5.26},
    {"mandible", kAdd, kEllipsoid, kPaired, {41.38, -12.69, -7.42}, {4.62, 5.77, 7.21}, {101.69, 73.57, 32.49}, 0.00, 5.19},
    {"mandible", kAdd, kEllipsoid, kPaired, {23.47, -67.72, -57.08}, {5.62, 17.92, 10.80}, {-6.78, -25.94, 141.23}, 0.00, 3.93},
    {"mandible", kAdd, kEllipsoid, kPaired, {37.81, -44.14, -31.08}, {2.91, 6.31, 14.57}, {16.04, 11.11, -11.63}, 0.00, 2.86},
    {"mandible", kAdd, kEllipsoid, kPaired, {14.12, -81.42, -52.59}, {3.93, 6.67, 8.53}, {96.78, 4.88, -60.88}, 0.00, 4.27},
    {"mandible", kAdd, kEllipsoid, kPaired, {40.72, -19.85, -26.28}, {3.29, 4.49, 16.43}, {162.32, 19.42, -24.85}, 0.00, 1.15},
    {"mandible", kAdd, kEllipsoid, kPaired, {24.04, -58.11, -51.96}, {4.52, 5.50, 14.75}, {-59.06, -10.64, -44.97}, 0.00, 2.85},
    {"mandible", kAdd, kEllipsoid, kPaired, {36.20, -46.48, -36.62}, {2.94, 7.91, 14.71}, {-177.94, -5.16, 19.39}, 0.00, 1.03},
    {"mandible", kAdd, kEllipsoid, kPaired, {30.80, -48.59, -51.09}, {3.73, 8.64, 11.61}, {138.54, -57.28, 12.25}, 0.00, 2.04},
    {"mandible", kAdd, kEllipsoid, kPaired, {13.85, -79.03, -66.95}, {4.69, 4.09, 16.46}, {53.66, -80.28, 20.77}, 0.00, 3.17},
    {"mandible", kAdd, kEllipsoid, kPaired, {38.04, -36.59, -34.68}, {3.52, 10.97, 17.59}, {172.51, -6.30, -16.32}, 0.00, 1.23},
    {"mandible", kAdd, kEllipsoid, kPaired, {20.44, -72.00, -55.80}, {5.37, 10.65, 18.09}, {94.77, -28.11, -32.40}, 0.00, 1.88},
    {"mandible", kAdd, kEllipsoid, kMedian, {0.00, -88.27, -51.41}, {13.26, 3.13, 5.99}, {-131.00, 0.00, 0.00}, 0.00, 2.27},
    {"mandible", kAdd, kEllipsoid, kPaired, {37.43, -27.21, -42.61}, {2.87, 6.88, 12.00}, {13.15, -170.32, 30.30}, 0.00, 3.00},
    {"mandible", kAdd, kEllipsoid, kPaired, {30.86, -56.86, -51.18}, {4.38, 7.64, 13.59}, {131.48, -3.63, -27.94}, 0.00, 2.33},
    {"mandible", kAdd, kEllipsoid, kPaired, {41.95, -18.79, -18.26}, {2.57, 12.85, 6.22}, {62.76, 13.62, -1.56}, 0.00, 1.46},
    {"mandible", kAdd, kEllipsoid, kPaired, {20.56, -67.85, -53.73}, {4.03, 5.32, 9.90}, {-2.83, -159.18, 59.06}, 0.00, 4.73},
    {"mandible", kAdd, kEllipsoid, kPaired, {34.00, -52.18, -44.26}, {2.84, 12.90, 6.25}, {-118.99, 5.60, 26.39}, 0.00, 1.48},
    {"mandible", kAdd, kEllipsoid, kPaired, {8.28, -84.01, -59.42}, {4.08, 12.58, 10.54}, {28.96, -10.56, -63.58}, 0.00, 2.96},
    {"mandible", kAdd, kEllipsoid, kPaired, {36.89, -34.54, -51.19}, {2.67, 5.37, 11.73}, {-70.65, -5.47, -10.27}, 0.00, 1.48},
    {"mandible", kAdd, kEllipsoid, kPaired, {38.06, -35.89, -32.65}, {4.03, 5.07, 2.97}, {52.81, -43.48, -25.98}, 0.00, 3.28},
    {"mandible", kAdd, kEllipsoid, kPaired, {27.61, -59.29, -56.40}, {15.26, 5.02, 9.22}, {-3.26, -30.47, 59.61}, 0.00, 3.20},
    {"mandible", kAdd, kEllipsoid, kPaired, {34.34, -45.03, -48.82}, {4.05, 13.54, 10.49}, {-7.49, -42.88, 157.91}, 0.00, 2.20},
    {"mandible", kAdd, kEllipsoid, kPaired, {44.25, -14.05, -11.51}, {4.71, 2.89, 6.74}, {146.39, -1.10, -52.05}, 0.00, 4.24},
    {"mandible", kAdd, kEllipsoid, kPaired, {33.42, -43.84, -38.86}, {4.24, 3.16, 9.11}, {-11.86, 47.25, 38.71}, 0.00, 3.16},
    {"relief carve", kCarve, kEllipsoid, kPaired, {35.99, -46.10, -18.53}, {0.97, 3.79, 4.05}, {-148.77, 31.41, 18.28}, 0.00, 3.42},
    {"relief carve", kCarve, kEllipsoid, kPaired, {33.87, -50.85, -27.29}, {2.40, 2.93, 6.65}, {166.70, 49.79, 5.27}, 0.00, 2.51},
    {"relief carve", kCarve, kEllipsoid, kPaired, {37.18, -48.17, -14.79}, {0.75, 2.73, 3.74}, {6.02, -115.64, 86.98}, 0.00, 2.46},
    {"relief carve", kCarve, kEllipsoid, kPaired, {33.99, -27.45, -29.31}, {3.21, 3.35, 8.56}, {-24.11, 19.74, 59.60}, 0.00, 3.02},
    {"relief carve", kCarve, kEllipsoid, kPaired, {34.20, -39.75, -21.24}, {3.27, 5.27, 11.38}, {-4.86, 28.36, 3.26}, 0.00, 4.67},
    {"relief carve", kCarve, kEllipsoid, kPaired, {19.32, -74.90, -44.01}, {5.88, 4.02, 12.68}, {14.82, 109.36, 126.19}, 0.00, 2.29},
    {"relief carve", kCarve, kEllipsoid, kPaired, {11.83, -89.05, -45.71}, {3.73, 2.81, 14.03}, {-60.57, 66.98, -25.18}, 0.00, 3.20},
    {"relief carve", kCarve, kEllipsoid, kPaired, {32.39, -53.79, -32.27}, {7.10, 3.79, 5.44}, {-88.27, 82.13, 93.89}, 0.00, 3.72},
    {"relief add", kAdd, kEllipsoid, kPaired, {40.09, -45.33, -22.21}, {1.64, 6.54, 8.18}, {11.10, -64.63, 150.06}, 0.00, 0.57},
    {"relief add", kAdd, kEllipsoid, kPaired, {39.16, -50.21, -22.16}, {1.83, 3.98, 9.17}, {-167.51, 0.72, 3.58}, 0.00, 0.64},
    {"relief add", kAdd, kEllipsoid, kPaired, {41.17, -48.39, -13.19}, {1.18, 2.79, 5.91}, {-36.87, -161.83, -45.57}, 0.00, 0.97},
    {"relief add", kAdd, kEllipsoid, kPaired, {41.19, -25.47, -23.81}, {2.26, 9.01, 11.30}, {122.46, 3.32, -10.68}, 0.00, 0.79},
    {"relief add", kAdd, kEllipsoid, kPaired, {6.67, -90.23, -52.36}, {0.74, 0.70, 2.96}, {-85.56, 123.32, 66.76}, 0.00, 2.00},
    {"relief add", kAdd, kEllipsoid, kPaired, {40.18, -51.41, -13.64}, {2.83, 1.39, 4.10}, {-141.20, -107.38, 11.99}, 0.00, 1.66},
    {"relief add", kAdd, kEllipsoid, kMedian, {0.00, -85.96, -62.05}, {7.14, 1.43, 7.15}, {-8.20, 0.00, 0.00}, 0.00, 4.06},
    {"relief add", kAdd, kEllipsoid, kPaired, {29.45, -53.61, -48.03}, {3.74, 4.14, 4.38}, {-54.06, 71.85, 64.43}, 0.00, 3.73},
    {"lower incisor 1 root", kAdd, kEllipsoid, kPaired, {2.18, -87.76, -54.60}, {1.50, 2.07, 11.54}, {0.31, -27.97, 177.36}, 0.00, 0.50},
    {"lower incisor 2 root", kAdd, kEllipsoid, kPaired, {5.95, -87.71, -53.69}, {1.58, 2.02, 10.67}, {-8.03, 21.12, -171.78}, 0.00, 0.50},
    {"lower canine root", kAdd, kEllipsoid, kPaired, {10.49, -86.20, -55.49}, {2.25, 1.92, 12.07}, {-3.75, -29.87, 161.46}, 0.00, 0.50},
    {"lower premolar 1 root", kAdd, kEllipsoid, kPaired, {16.05, -81.25, -51.84}, {2.92, 3.12, 11.54}, {-13.28, -176.34, -32.97}, 0.00, 0.50},
    {"lower premolar 2 root", kAdd, kEllipsoid, kPaired, {19.84, -74.56, -51.48}, {2.50, 2.91, 11.70}, {-90.32, 137.92, 21.70}, 0.00, 0.50},
    {"lower molar 1 root", kAdd, kEllipsoid, kPaired, {22.86, -66.90, -47.91}, {4.25, 5.51, 8.70}, {-149.94, 43.76, -1.82}, 0.00, 0.50},
    {"lower molar 2 root", kAdd, kEllipsoid, kPaired, {27.64, -55.71, -46.81}, {2.39, 5.02, 8.42}, {31.52, 2.01, -6.25}, 0.00, 0.50},
    {"lower incisor 1 crown", kAdd, kSlab, kPaired, {2.83, -92.29, -47.23}, {2.03, 2.59, 7.87}, {26.07, -27.17, 102.59}, 2.03, 0.50},
    {"lower incisor 2 crown", kAdd, kSlab, kPaired, {7.73, -91.94, -47.15}, {2.35, 2.83, 7.35}, {22.83, 19.32, -34.87}, 2.35, 0.50},
    {"lower canine crown", kAdd, kSlab, kPaired, {11.91, -88.03, -48.15}, {2.78, 3.54, 7.72}, {24.22, -26.66, 162.06}, 2.78, 0.50},
    {"lower premolar 1 crown", kAdd, kSlab, kPaired, {16.14, -82.50, -45.59}, {4.04, 3.61, 4.28}, {76.31, -36.66, 92.54}, 3.60, 0.50},
    {"lower premolar 2 crown", kAdd, kSlab, kPaired, {19.17, -75.65, -45.04}, {3.21, 3.84, 4.25}, {75.86, 22.67, 41.05}, 3.16, 0.50},
    {"lower molar 1 crown", kAdd, kSlab, kPaired, {21.33, -67.50, -43.22}, {3.41, 4.99, 5.72}, {-70.11, -68.54, -80.91}, 2.99, 0.50},
    {"lower molar 2 crown", kAdd, kSlab, kPaired, {25.50, -56.67, -43.57}, {6.10, 4.67, 4.99}, {-57.81, 46.85, 52.00}, 3.18, 0.50},
};
// clang-format on

}  // namespace

std::span<const StrokeRow> mandible_strokes() { return kStrokes; }

}  // namespace skullstation
