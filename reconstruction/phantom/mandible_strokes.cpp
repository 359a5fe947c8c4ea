#include "reconstruction/phantom/skull_strokes.h"

namespace skullstation {

namespace {

constexpr Stroke::Tool kAdd = Stroke::Tool::add;
constexpr Stroke::Form kEllipsoid = Stroke::Form::ellipsoid;
constexpr Stroke::Form kSlab = Stroke::Form::slab;
constexpr bool kPaired = true;
constexpr bool kMedian = false;

// clang-format off
// part, tool, form, side, center [mm], half size [mm], rotation vector [deg], rounding [mm], blend [mm]
constexpr StrokeRow kStrokes[] = {
    {"mandible", kAdd, kEllipsoid, kPaired, {36.45, -38.13, -43.35}, {6.63, 3.94, 14.83}, {-41.85, 55.75, 76.07}, 0.00, 5.00},
    {"mandible", kAdd, kEllipsoid, kMedian, {0.00, -88.01, -65.11}, {4.74, 4.88, 6.17}, {-129.30, 0.00, 0.00}, 0.00, 5.00},
    {"mandible", kAdd, kEllipsoid, kPaired, {40.70, -12.54, -7.10}, {4.32, 5.66, 6.51}, {108.74, 71.21, 28.32}, 0.00, 5.00},
    {"mandible", kAdd, kEllipsoid, kPaired, {21.91, -69.45, -62.69}, {4.08, 12.65, 6.57}, {-11.79, -15.90, 139.82}, 0.00, 2.80},
    {"mandible", kAdd, kEllipsoid, kPaired, {41.01, -47.49, -15.51}, {1.11, 3.71, 8.89}, {34.46, 6.32, -21.73}, 0.00, 0.40},
    {"mandible", kAdd, kEllipsoid, kPaired, {10.55, -82.72, -59.23}, {10.87, 4.27, 10.07}, {-19.26, 72.46, 30.20}, 0.00, 2.14},
    {"mandible", kAdd, kEllipsoid, kPaired, {39.99, -21.78, -29.58}, {2.99, 5.56, 11.32}, {162.24, 19.42, -24.40}, 0.00, 1.46},
    {"mandible", kAdd, kEllipsoid, kPaired, {25.76, -57.88, -51.60}, {5.41, 6.91, 16.16}, {-60.24, -19.89, -59.74}, 0.00, 1.71},
    {"mandible", kAdd, kEllipsoid, kPaired, {38.40, -46.95, -28.40}, {1.99, 4.39, 15.91}, {-154.43, 0.48, 7.92}, 0.00, 3.41},
    {"mandible", kAdd, kEllipsoid, kPaired, {31.41, -51.96, -52.10}, {4.76, 11.49, 8.68}, {157.32, -36.03, -4.04}, 0.00, 2.54},
    {"mandible", kAdd, kEllipsoid, kPaired, {15.04, -77.71, -66.64}, {4.82, 3.78, 10.02}, {57.47, -83.83, 20.17}, 0.00, 3.56},
    {"mandible", kAdd, kEllipsoid, kPaired, {40.18, -37.20, -24.65}, {1.90, 5.37, 9.20}, {129.73, 3.63, -14.33}, 0.00, 3.65},
    {"mandible", kAdd, kEllipsoid, kPaired, {24.72, -66.66, -56.70}, {5.10, 9.32, 15.80}, {106.57, -31.97, -26.80}, 0.00, 3.80},
    {"mandible", kAdd, kEllipsoid, kMedian, {0.00, -86.62, -57.84}, {5.52, 4.15, 8.77}, {-179.52, 0.00, 0.00}, 0.00, 3.81},
    {"mandible", kAdd, kEllipsoid, kPaired, {36.88, -25.48, -44.31}, {2.39, 4.63, 9.48}, {8.01, -173.15, 28.36}, 0.00, 4.57},
    {"mandible", kAdd, kEllipsoid, kPaired, {31.77, -53.89, -48.67}, {3.92, 7.71, 14.37}, {141.66, 12.28, -33.34}, 0.00, 3.69},
    {"mandible", kAdd, kEllipsoid, kPaired, {42.09, -21.36, -18.57}, {1.00, 7.90, 6.49}, {15.46, 10.06, -0.97}, 0.00, 4.39},
    {"mandible", kAdd, kEllipsoid, kPaired, {19.76, -71.25, -53.16}, {4.48, 6.82, 14.41}, {-12.21, -117.35, 95.45}, 0.00, 6.68},
    {"mandible", kAdd, kEllipsoid, kPaired, {35.78, -49.64, -36.98}, {0.97, 4.92, 7.75}, {172.46, 29.21, -32.00}, 0.00, 3.65},
    {"mandible", kAdd, kEllipsoid, kPaired, {5.09, -86.14, -67.07}, {4.46, 7.32, 5.23}, {-24.17, -41.25, -53.13}, 0.00, 2.99},
    {"mandible", kAdd, kEllipsoid, kPaired, {36.84, -34.78, -50.82}, {2.90, 5.79, 8.70}, {-73.22, -2.93, -10.63}, 0.00, 3.00},
    {"mandible", kAdd, kEllipsoid, kPaired, {39.99, -31.31, -30.93}, {3.10, 8.94, 6.86}, {68.64, -3.78, -12.96}, 0.00, 3.39},
    {"mandible", kAdd, kEllipsoid, kPaired, {28.33, -59.66, -59.05}, {4.01, 11.45, 6.37}, {-25.61, -10.12, 148.26}, 0.00, 3.89},
    {"mandible", kAdd, kEllipsoid, kPaired, {33.29, -43.60, -47.55}, {2.86, 4.89, 11.08}, {-20.40, -25.40, 149.84}, 0.00, 4.37},
    {"mandible", kAdd, kEllipsoid, kPaired, {44.70, -14.58, -12.53}, {3.14, 2.22, 6.71}, {146.47, -5.29, -41.70}, 0.00, 7.56},
    {"mandible", kAdd, kEllipsoid, kPaired, {36.90, -39.63, -35.40}, {5.88, 4.28, 10.44}, {-18.28, 49.53, 86.85}, 0.00, 4.61},
    {"lower incisor 1 root", kAdd, kEllipsoid, kPaired, {2.68, -87.81, -52.72}, {3.80, 3.20, 9.40}, {-147.56, -13.00, -15.10}, 0.00, 1.00},
    {"lower incisor 1 crown", kAdd, kSlab, kPaired, {3.30, -93.23, -46.39}, {1.45, 2.69, 6.42}, {15.67, -26.70, 103.16}, 1.45, 1.00},
    {"lower incisor 2 root", kAdd, kEllipsoid, kPaired, {6.50, -88.51, -50.80}, {2.71, 3.72, 10.06}, {-138.36, -10.61, 13.10}, 0.00, 1.00},
    {"lower incisor 2 crown", kAdd, kSlab, kPaired, {7.97, -92.17, -45.53}, {1.41, 2.96, 5.59}, {-81.57, -126.43, -32.59}, 1.41, 1.00},
    {"lower canine root", kAdd, kEllipsoid, kPaired, {11.40, -85.57, -52.05}, {3.65, 4.70, 9.32}, {-146.70, 42.80, 17.64}, 0.00, 1.00},
    {"lower canine crown", kAdd, kSlab, kPaired, {13.08, -89.93, -44.39}, {1.79, 3.15, 3.32}, {144.70, -47.34, -34.00}, 1.79, 1.00},
    {"lower premolar 1 root", kAdd, kEllipsoid, kPaired, {15.87, -82.45, -49.48}, {3.69, 3.55, 8.58}, {8.04, 8.03, -12.04}, 0.00, 1.00},
    {"lower premolar 1 crown", kAdd, kSlab, kPaired, {16.08, -82.37, -44.61}, {3.54, 2.48, 4.07}, {-31.65, 134.37, 104.48}, 2.48, 1.00},
    {"lower premolar 2 root", kAdd, kEllipsoid, kPaired, {19.49, -74.96, -48.18}, {2.69, 3.83, 7.96}, {-68.39, 151.03, 34.83}, 0.00, 1.00},
    {"lower premolar 2 crown", kAdd, kSlab, kPaired, {19.03, -75.47, -44.17}, {3.37, 3.67, 2.62}, {167.65, 38.67, 26.47}, 2.27, 1.00},
    {"lower molar 1 root", kAdd, kEllipsoid, kPaired, {22.30, -67.08, -45.97}, {3.93, 5.69, 6.89}, {-27.74, -13.09, -154.15}, 0.00, 1.00},
    {"lower molar 1 crown", kAdd, kSlab, kPaired, {20.86, -67.69, -42.99}, {2.87, 4.37, 5.51}, {76.01, 65.65, -68.86}, 2.26, 1.00},
    {"lower molar 2 root", kAdd, kEllipsoid, kPaired, {25.41, -57.05, -43.31}, {4.98, 4.70, 5.87}, {-33.09, -2.66, -25.73}, 0.00, 0.73},
    {"lower molar 2 crown", kAdd, kSlab, kPaired, {24.26, -57.50, -40.92}, {2.86, 4.46, 4.97}, {55.00, -106.03, 67.48}, 2.62, 1.00},
};
// clang-format on

}  // namespace

std::span<const StrokeRow> mandible_strokes() { return kStrokes; }

}  // namespace skullstation
