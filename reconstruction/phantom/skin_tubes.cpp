#include "reconstruction/phantom/skin_tables.h"

namespace skullstation {

namespace {

constexpr TubeRow::Tool kAdd = TubeRow::Tool::add;
constexpr TubeRow::Tool kCarve = TubeRow::Tool::carve;
constexpr bool kPaired = true;
constexpr bool kMedian = false;

// clang-format off
// Each point: centre [mm], radius [mm].
constexpr TubePoint kCranium[] = {
    {{0, -10, 44}, 70},
    {{0, 22, 46}, 70},};
constexpr TubePoint kFace[] = {
    {{0, -42, 12}, 49},
    {{0, -48, -28}, 49},};
constexpr TubePoint kNeck[] = {
    {{0, 22, -10}, 57},
    {{0, 22, -150}, 57},};
constexpr TubePoint kNose[] = {
    {{0, -82, 26}, 8.5},
    {{0, -106, -6}, 8.5},};

// part, tool, side, blend [mm], points
constexpr TubeRow kRoughForms[] = {
    {"cranium", kAdd, kMedian, 0, kCranium},
    {"face", kAdd, kMedian, 40, kFace},
    {"neck", kAdd, kMedian, 40, kNeck},
    {"nose", kAdd, kMedian, 16, kNose},
};

constexpr TubePoint kUpperLid[] = {
    {{22.02, -74.92, 17.37}, 1.5},
    {{25.3, -77.41, 16.85}, 1.5},
    {{29.18, -78.42, 16.52}, 1.5},
    {{32.92, -78.45, 16.43}, 1.5},
    {{36.66, -77.86, 16.91}, 1.5},
    {{40.31, -75.48, 17.99}, 1.5},};
constexpr TubePoint kLidSlit[] = {
    {{18.66, -75.74, 17.71}, 0.5},
    {{21.45, -77.03, 16.71}, 0.7},
    {{24.98, -78.64, 15.62}, 0.8},
    {{28.98, -79.34, 14.99}, 0.8},
    {{33.01, -79.36, 14.89}, 0.8},
    {{37.05, -78.74, 15.48}, 0.8},
    {{41.1, -76.51, 16.82}, 0.7},
    {{44.58, -73.3, 18.6}, 0.5},};
constexpr TubePoint kLidCrease[] = {
    {{19.53, -74.77, 21.27}, 0.6},
    {{22.33, -77.98, 24.26}, 0.9},
    {{26.39, -79.39, 26.28}, 1.1},
    {{30.99, -80.25, 26.97}, 1.1},
    {{36.07, -79.75, 26.38}, 1.1},
    {{41.27, -77.26, 24.15}, 0.9},
    {{45.86, -73.45, 20.82}, 0.6},};
constexpr TubePoint kMouthSlit[] = {
    {{-26.63, -91.61, -39.93}, 0.6},
    {{-22.06, -95.69, -39.45}, 0.8},
    {{-16.04, -100.63, -38.76}, 0.9},
    {{-9.04, -104.75, -38.22}, 0.9},
    {{-4.03, -106.05, -38.41}, 0.9},
    {{0, -106.78, -38.9}, 0.9},
    {{4.03, -106.05, -38.41}, 0.9},
    {{9.04, -104.75, -38.22}, 0.9},
    {{16.04, -100.63, -38.76}, 0.9},
    {{22.06, -95.69, -39.45}, 0.8},
    {{26.63, -91.61, -39.93}, 0.6},};

constexpr TubeRow kFeatures[] = {
    {"upper lid margin", kAdd, kPaired, 1.5, kUpperLid},
    {"lid slit", kCarve, kPaired, 0.5, kLidSlit},
    {"lid crease", kCarve, kPaired, 2, kLidCrease},
    {"mouth slit", kCarve, kMedian, 1.2, kMouthSlit},
};
// clang-format on

}  // namespace

std::span<const TubeRow> skin_rough_forms() { return kRoughForms; }

std::span<const TubeRow> skin_features() { return kFeatures; }

}  // namespace skullstation
